//! The sum of a row's values: a bit that flips on the disk is seen.

use rusqlite::Row;
use rusqlite::types::ValueRef;
use std::ops::Range;

/// FNV-1a, 64 bits: its offset and its prime.
const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// The sum of a row's values.
pub(super) fn sum(values: &[ValueRef<'_>]) -> i64 {
    let mut hash = OFFSET;
    let mut feed = |bytes: &[u8]| {
        for byte in bytes {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
    };
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
    hash.cast_signed()
}

/// Whether the sum, which stands behind the values in these columns, is theirs.
pub(super) fn is_whole(row: &Row<'_>, values: Range<usize>) -> rusqlite::Result<bool> {
    let behind = values.end;
    let all: Vec<ValueRef<'_>> = values
        .map(|index| row.get_ref(index))
        .collect::<Result<_, _>>()?;
    Ok(row.get_ref(behind)? == ValueRef::Integer(sum(&all)))
}
