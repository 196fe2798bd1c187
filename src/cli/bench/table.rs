//! Tables in Markdown.

/// A table: words to the left, numbers to the right of them.
pub struct Table {
    columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// One of these columns and no rows yet.
    pub fn new<S: Into<String>>(columns: impl IntoIterator<Item = S>) -> Self {
        Self { columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// The lines, columns aligned; the first `words` columns are words.
    pub fn lines(&self, words: usize) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| &row[column]).chain([&self.columns[column]]);
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0).max(3)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let line = |cells: &[String]| {
            let pad = |(i, cell): (usize, &String)| {
                let (cell, width) = (cell.as_str(), widths[i]);
                if i < words { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            };
            let cells: Vec<String> = cells.iter().enumerate().map(pad).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = |(i, width): (usize, &usize)| {
            let dashes = "-".repeat(width - 1);
            if i < words { format!("{dashes}-") } else { format!("{dashes}:") }
        };
        let rules: Vec<String> = widths.iter().enumerate().map(rule).collect();
        let body: String = self.rows.iter().map(|row| line(row)).collect();
        format!("{}{}{body}\n", line(&self.columns), line(&rules))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_aligned() {
        let mut table = Table::new(["device", "ms"]);
        table.rows.push(vec!["cpu:1".into(), "1234".into()]);
        table.rows.push(vec!["software".into(), "9".into()]);
        let expected = "\
| device   |   ms |
| -------- | ---: |
| cpu:1    | 1234 |
| software |    9 |

";
        assert_eq!(table.lines(1), expected);
    }
}
