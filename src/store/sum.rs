//! The sum of a row's values: a bit that flips on the disk is seen.

use super::StoreError;
use fnv::FnvHasher;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row};
use std::hash::Hasher as _;
use std::ops::Range;

/// The sum of a row's values, FNV-1a of 64 bits.
pub(super) fn sum(values: &[ValueRef<'_>]) -> i64 {
    let mut hasher = FnvHasher::default();
    let mut feed = |bytes: &[u8]| hasher.write(bytes);
    for value in values {
        match value {
            ValueRef::Null => feed(&[0]),
            ValueRef::Integer(number) => {
                feed(&[1]);
                feed(&number.to_le_bytes());
            }
            ValueRef::Real(number) => {
                feed(&[2]);
                // The tables keep no negative zero.
                feed(&(number + 0.0).to_le_bytes());
            }
            ValueRef::Text(bytes) | ValueRef::Blob(bytes) => {
                feed(&[3]);
                feed(&(bytes.len() as u64).to_le_bytes());
                feed(bytes);
            }
        }
    }
    hasher.finish().cast_signed()
}

/// Whether the sum, which stands behind the values in these columns, is theirs.
pub(super) fn is_whole(row: &Row<'_>, values: Range<usize>) -> rusqlite::Result<bool> {
    let behind = values.end;
    Ok(row.get_ref(behind)? == ValueRef::Integer(sum_of(row, values)?))
}

/// Gives each row its sum over the values in these columns, taken for what was written. `rows` selects those after a number, so
/// many, the number first; `update` sets the sum, ?2, of the row of number ?1.
pub(super) fn seal_all(
    connection: &Connection,
    rows: &str,
    values: &Range<usize>,
    update: &str,
) -> Result<(), StoreError> {
    let mut query = connection.prepare(rows)?;
    let mut rows = query.query([0, i64::MAX])?;
    while let Some(row) = rows.next()? {
        let number: i64 = row.get(0)?;
        let sum = sum_of(row, values.clone())?;
        connection.prepare_cached(update)?.execute([number, sum])?;
    }
    Ok(())
}

/// The sum of the values in these columns.
fn sum_of(row: &Row<'_>, values: Range<usize>) -> rusqlite::Result<i64> {
    let all: Vec<ValueRef<'_>> = values
        .map(|index| row.get_ref(index))
        .collect::<Result<_, _>>()?;
    Ok(sum(&all))
}
