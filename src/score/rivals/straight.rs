//! A straight line through enough weighted points.

use crate::reading::LineFit;

/// Fewer points than this make no line, as for [`crate::forecast::InverseVelocityLine`].
const FEWEST_POINTS: usize = 4;

/// Of y by x through (x, y, weight); `None` under four points or where all stand at one x.
pub(super) fn line_through(points: &[(f64, f64, f64)]) -> Option<LineFit> {
    if points.len() < FEWEST_POINTS {
        return None;
    }
    LineFit::weighted(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_points_make_no_line() {
        let points = [(0.0, 1.0, 1.0), (1.0, 3.0, 1.0), (2.0, 5.0, 1.0)];
        assert_eq!(line_through(&points), None);
        let four = [points[0], points[1], points[2], (3.0, 7.0, 1.0)];
        assert_eq!(line_through(&four).map(|line| line.slope()), Some(2.0));
    }
}
