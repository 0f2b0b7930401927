//! A report as one HTML page, plots and pictures in it.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Document, Item, Section};
use crate::table::{Table, machine};

const STYLE: &str = "\
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1f26; margin: 2rem auto; max-width: 62rem; padding: 0 1rem }
h1 { font-size: 1.7rem } h2 { font-size: 1.25rem; margin-top: 2.2rem; border-bottom: 1px solid #d8dde3 }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; margin: .4rem 0 1.2rem }
th, td { padding: .18rem .6rem; text-align: right; border-bottom: 1px solid #e6e9ed }
th { vertical-align: bottom; font-weight: 600 }
th:first-child, td:first-child, .words { text-align: left }
tbody tr:hover { background: #f3f6f9 }
.wide { overflow-x: auto }
figure { margin: 1rem 0 } figure svg, figure img { max-width: 100%; height: auto }
figcaption, .machine { color: #56606b; font-size: 13px }
code { background: #f1f3f5; padding: .1rem .3rem }
nav a { margin-right: .9rem }";

/// The page.
pub(super) fn write(document: &Document) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (document.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (document.title) }
                p.machine { (machine(&document.machine)) br; "Measured by " code { (document.command) } }
                nav {
                    @for (index, section) in document.sections.iter().enumerate() {
                        a href={ "#s" (index) } { (section.title) }
                    }
                }
                @for (index, section) in document.sections.iter().enumerate() {
                    (one(index, section))
                }
            }
        }
    };
    page.into_string()
}

fn one(index: usize, section: &Section) -> Markup {
    html! {
        section id={ "s" (index) } {
            h2 { (section.title) }
            @for item in &section.items {
                @match item {
                    Item::Text(text) => p { (text) },
                    Item::List(lines) => ul { @for line in lines { li { (line) } } },
                    Item::Table(caption, table) => (rows(caption, table)),
                    Item::Plot(plot) => figure {
                        (PreEscaped(plot.svg()))
                        figcaption { (plot.caption) }
                    },
                    Item::Picture(picture) => figure {
                        img alt=(picture.caption) src={ "data:image/png;base64," (STANDARD.encode(&picture.png)) };
                        figcaption { (picture.caption) }
                    },
                }
            }
        }
    }
}

fn rows(caption: &str, table: &Table) -> Markup {
    let (heading, rows) = table.rows().split_first().unwrap_or((const { &Vec::new() }, &[]));
    // A column is of words if they are what its first row begins with.
    let words = |column: usize| {
        let first = rows.first().and_then(|row| row.get(column)?.chars().next());
        first.is_some_and(char::is_alphabetic)
    };
    html! {
        @if !caption.is_empty() { p { (caption) } }
        div.wide {
            table {
                thead { tr { @for (i, cell) in heading.iter().enumerate() { th.words[words(i)] { (cell) } } } }
                tbody { @for row in rows { tr { @for (i, cell) in row.iter().enumerate() { td.words[words(i)] { (cell) } } } } }
            }
        }
    }
}
