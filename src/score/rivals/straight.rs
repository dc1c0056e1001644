//! A straight line through weighted points.

/// Weighted least squares of y against x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Straight {
    mean_x: f64,
    mean_y: f64,
    pub(super) slope: f64,
}

/// Fewer points than this make no line, as for [`crate::forecast::InverseVelocityLine`].
const FEWEST: usize = 4;

impl Straight {
    /// Through (x, y, weight); `None` under four points or where all stand at one x.
    pub(super) fn through(points: &[(f64, f64, f64)]) -> Option<Self> {
        let total: f64 = points.iter().map(|(_, _, w)| w).sum();
        if points.len() < FEWEST || total.is_nan() || total <= 0.0 {
            return None;
        }
        let mean_x = points.iter().map(|(x, _, w)| w * x).sum::<f64>() / total;
        let mean_y = points.iter().map(|(_, y, w)| w * y).sum::<f64>() / total;
        let (mut xx, mut xy) = (0.0, 0.0);
        for (x, y, w) in points {
            xx += w * (x - mean_x) * (x - mean_x);
            xy += w * (x - mean_x) * (y - mean_y);
        }
        (xx > 0.0).then(|| Self {
            mean_x,
            mean_y,
            slope: xy / xx,
        })
    }

    /// The x at which it has the value `y`.
    pub(super) fn reaches(&self, y: f64) -> f64 {
        self.mean_x + (y - self.mean_y) / self.slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_decide_which_points_the_line_goes_through() {
        let points = [
            (0.0, 1.0, 1.0),
            (1.0, 3.0, 1.0),
            (2.0, 5.0, 1.0),
            (3.0, -80.0, 0.0),
        ];
        let line = Straight::through(&points).unwrap();
        assert!((line.slope - 2.0).abs() < 1e-12);
        assert!((line.reaches(9.0) - 4.0).abs() < 1e-12);
        assert_eq!(Straight::through(&points[..3]), None);
        assert_eq!(Straight::through(&[(1.0, 2.0, 1.0); 5]), None);
    }
}
