//! The middle of values.

use std::cmp::Ordering;

/// The middle of `values`, of an even number the upper one of both; `None` of none. Their order changes.
pub fn upper_median(values: &mut [f64]) -> Option<f64> {
    upper_median_by(values, f64::total_cmp)
}

/// The same of values in the order of `compare`.
pub fn upper_median_by<T: Copy>(
    values: &mut [T],
    compare: impl FnMut(&T, &T) -> Ordering,
) -> Option<T> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, compare).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_an_even_number_it_is_the_upper_one_of_both_in_the_middle() {
        assert_eq!(upper_median(&mut [3.0, 1.0, 4.0, 2.0]), Some(3.0));
        assert_eq!(upper_median(&mut [2.0, 9.0, 1.0]), Some(2.0));
        assert_eq!(upper_median(&mut []), None);
    }
}
