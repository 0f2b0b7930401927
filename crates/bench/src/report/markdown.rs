//! A report as Markdown, beside the files of its plots and pictures.

use super::{Document, Item};
use crate::table::{Table, machine};

/// The document's text.
pub(super) fn write(document: &Document) -> String {
    let mut text = format!(
        "# {}\n\nMeasured by `{}` on\n{}",
        escape(&document.title),
        document.command,
        machine(&document.machine)
    );
    for section in &document.sections {
        text += &format!("\n## {}\n", escape(&section.title));
        for item in &section.items {
            text.push('\n');
            match item {
                Item::Text(paragraph) => text += &format!("{}\n", escape(paragraph)),
                Item::List(lines) => text.extend(lines.iter().map(|line| format!("- {}\n", escape(line)))),
                Item::Table(caption, table) => {
                    if !caption.is_empty() {
                        text += &format!("{}\n\n", escape(caption));
                    }
                    text += &rows(table);
                }
                Item::Plot(plot) => text += &shown(&plot.caption, &plot.name, "svg"),
                Item::Picture(picture) => text += &shown(&picture.caption, &picture.name, "png"),
            }
        }
    }
    text
}

fn shown(caption: &str, name: &str, ending: &str) -> String {
    let caption = escape(caption);
    format!("![{caption}]({name}.{ending})\n\n*{caption}*\n")
}

fn rows(table: &Table) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<_> = cells.iter().map(|cell| escape(cell)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let [heading, rows @ ..] = table.rows() else {
        return String::new();
    };
    let rule = format!("|---|{}\n", "---:|".repeat(heading.len().saturating_sub(1)));
    line(heading) + &rule + &rows.iter().map(|row| line(row)).collect::<String>()
}

/// Text whose signs mean nothing to Markdown.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '|' | '*' | '_' | '`' | '[' | ']' | '\\' => escaped.extend(['\\', c]),
            '<' => escaped += "&lt;",
            '\n' => escaped.push(' '),
            _ => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cannot_break_a_table() {
        let mut table = Table::new(&["name", "n"]);
        table.row(vec!["a|b_c <i>\n".into(), "1".into()]);
        assert_eq!(
            rows(&table),
            "| name | n |\n|---|---:|\n| a\\|b\\_c &lt;i>  | 1 |\n"
        );
    }
}
