//! Reports as documents: sections of text, tables, plots and pictures, written as text for a terminal, as Markdown
//! for documents, and as one HTML page that needs nothing beside it.

mod html;
mod markdown;
mod plot;
pub mod sections;

use std::path::Path;

use rayward::image_io::write_bytes;

pub use plot::{Plot, PlotKind, Series};

use crate::table::{Table, machine};
use crate::{Machine, Result};

/// A report.
#[derive(Clone, Debug)]
pub struct Document {
    /// Its heading.
    pub title: String,
    /// What it was measured on.
    pub machine: Machine,
    /// The command that measures it again.
    pub command: String,
    /// What it says, in order.
    pub sections: Vec<Section>,
}

/// One part of a report.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// What is in it, in order.
    pub items: Vec<Item>,
}

/// One thing in a section.
#[derive(Clone, Debug)]
pub enum Item {
    /// A paragraph.
    Text(String),
    /// Lines of a list.
    List(Vec<String>),
    /// A table under its caption, which may be empty.
    Table(String, Table),
    /// Curves.
    Plot(Plot),
    /// A picture.
    Picture(Picture),
}

/// A picture in a report.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name of its file, without its ending.
    pub name: String,
    /// What it shows.
    pub caption: String,
    /// The PNG file's bytes.
    pub png: Vec<u8>,
}

impl Section {
    /// An empty section.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            items: Vec::new(),
        }
    }

    /// With a paragraph more.
    #[must_use]
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.items.push(Item::Text(text.into()));
        self
    }

    /// With a list more.
    #[must_use]
    pub fn list(mut self, lines: Vec<String>) -> Self {
        self.items.push(Item::List(lines));
        self
    }

    /// With a table more.
    #[must_use]
    pub fn table(mut self, caption: impl Into<String>, table: Table) -> Self {
        self.items.push(Item::Table(caption.into(), table));
        self
    }

    /// With a plot more, unless there is nothing in it.
    #[must_use]
    pub fn plot(mut self, plot: Plot) -> Self {
        if !plot.is_empty() {
            self.items.push(Item::Plot(plot));
        }
        self
    }
}

impl Document {
    /// For a terminal: plots and pictures are left out.
    pub fn text(&self) -> String {
        let mut text = machine(&self.machine);
        for section in &self.sections {
            text += &format!("\n{}\n", section.title);
            for item in &section.items {
                match item {
                    Item::Text(paragraph) => text += &format!("{paragraph}\n"),
                    Item::List(lines) => text.extend(lines.iter().map(|line| format!("{line}\n"))),
                    Item::Table(caption, table) if caption.is_empty() => text += &table.text(),
                    Item::Table(caption, table) => text += &format!("\n{caption}\n{}", table.text()),
                    Item::Plot(_) | Item::Picture(_) => {}
                }
            }
        }
        text
    }

    /// Writes `index.html`, `report.md`, and the plots and pictures that the latter shows, into a folder, which is made
    /// if it is not there. Each file is whole or not there.
    ///
    /// # Errors
    /// What [`rayward::image_io::write_bytes`] says.
    pub fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(|source| rayward::Error::Write {
            path: folder.into(),
            source,
        })?;
        let put = |name: &str, bytes: &[u8]| write_bytes(&folder.join(name), bytes);
        for item in self.sections.iter().flat_map(|section| &section.items) {
            match item {
                Item::Plot(plot) => put(&format!("{}.svg", plot.name), plot.svg().as_bytes())?,
                Item::Picture(picture) => put(&format!("{}.png", picture.name), &picture.png)?,
                Item::Text(_) | Item::List(_) | Item::Table(..) => {}
            }
        }
        put("report.md", markdown::write(self).as_bytes())?;
        Ok(put("index.html", html::write(self).as_bytes())?)
    }
}
