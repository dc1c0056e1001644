//! The columns of a source's files, those with the same ones together.

use super::view::{ColumnView, LayoutView, SourceView};
use crate::runtime::ingest::Meaning;
use std::path::Path;

/// Notes what the columns of `file` are taken for.
pub(super) fn keep_layout(view: &mut SourceView, file: &Path, meanings: Vec<(String, Meaning)>) {
    let columns: Vec<ColumnView> = meanings
        .into_iter()
        .map(|(name, meaning)| ColumnView { name, meaning })
        .collect();
    if columns.is_empty() {
        return;
    }
    match view
        .layouts
        .iter_mut()
        .find(|layout| layout.columns == columns)
    {
        Some(layout) => layout.files += 1,
        None => view.layouts.push(LayoutView {
            file: file.to_owned(),
            files: 1,
            columns,
        }),
    }
}
