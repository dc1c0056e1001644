//! Bytes that carry a sum over themselves and what stands beside them: a bit that flips on the disk is seen.

use super::sum::sum;
use rusqlite::types::ValueRef;

/// No MessagePack begins with it: bytes without a seal are of an earlier version.
const MARK: u8 = 0xc1;
const SUM_BYTES: usize = 8;

/// `body` under a seal that holds for it beside these values.
pub(super) fn seal(beside: &[ValueRef<'_>], body: &[u8]) -> Vec<u8> {
    let mut sealed = vec![MARK];
    sealed.extend(of(beside, body).to_le_bytes());
    sealed.extend(body);
    sealed
}

/// The body under the seal; `None` where it, or what stands beside it, is not what was written.
pub(super) fn unseal<'a>(beside: &[ValueRef<'_>], sealed: &'a [u8]) -> Option<&'a [u8]> {
    let Some((&MARK, rest)) = sealed.split_first() else {
        return Some(sealed);
    };
    let (sum, body) = rest.split_first_chunk::<SUM_BYTES>()?;
    (i64::from_le_bytes(*sum) == of(beside, body)).then_some(body)
}

fn of(beside: &[ValueRef<'_>], body: &[u8]) -> i64 {
    let all: Vec<ValueRef<'_>> = beside
        .iter()
        .copied()
        .chain([ValueRef::Blob(body)])
        .collect();
    sum(&all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_under_a_seal_is_seen_and_bytes_without_one_are_taken() {
        let beside = [ValueRef::Text(b"5")];
        let sealed = seal(&beside, b"what was remembered");
        assert_eq!(unseal(&beside, &sealed), Some(&b"what was remembered"[..]));
        assert_eq!(unseal(&[ValueRef::Text(b"6")], &sealed), None);
        // The first byte shows whether there is a seal.
        for bit in 8..8 * sealed.len() {
            let mut flipped = sealed.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(unseal(&beside, &flipped), None, "{bit}");
        }
        assert_eq!(unseal(&beside, b"\x81earlier"), Some(&b"\x81earlier"[..]));
    }
}
