//! CSV files of numbers under titles.

use crate::error::EvaluationError;

/// Numbers under a title.
#[derive(Clone, Debug, PartialEq)]
pub struct TitledColumn {
    /// The title.
    pub title: String,
    /// The numbers.
    pub numbers: Vec<f64>,
}

/// Reads columns of numbers under a line of titles.
///
/// # Errors
/// If a line has another number of fields than the titles, or a field that is not a number.
pub fn read_columns(text: &str) -> Result<Vec<TitledColumn>, EvaluationError> {
    let titles = text.lines().next().unwrap_or_default().split(',');
    let column = |title: &str| TitledColumn { title: title.trim().into(), numbers: Vec::new() };
    let mut columns: Vec<_> = titles.map(column).collect();
    for (line, text) in number_lines(text) {
        let numbers: Option<Vec<f64>> = text.split(',').map(|f| f.trim().parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == columns.len());
        let expected = "a number for each title";
        let bad = || EvaluationError::BadLine { line, expected, text: text.into() };
        for (column, number) in columns.iter_mut().zip(numbers.ok_or_else(bad)?) {
            column.numbers.push(number);
        }
    }
    Ok(columns)
}

/// Returns the lines below the titles that are not empty, with their numbers from 1.
pub(crate) fn number_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).skip(1).filter(|(_, line)| !line.trim().is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_their_titles_and_bad_lines_their_numbers() {
        let columns = read_columns("scan, seconds\n0,0.1\n\n1,0.3\n").unwrap();
        assert_eq!(columns[1].title, "seconds");
        assert_eq!(columns[1].numbers, [0.1, 0.3]);
        let error = read_columns("scan,seconds\n0,0.1\n1\n").unwrap_err().to_string();
        assert!(error.contains("line 3"), "{error}");
    }
}
