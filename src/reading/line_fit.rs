//! A straight line through points, by least squares.

/// The line of y by x, and the sums that it is made of: x, y and weights in whatever units they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineFit {
    /// The sum of the weights; where there are none, the number of points.
    pub weight: f64,
    /// The mean of x.
    pub mean_x: f64,
    /// The mean of y.
    pub mean_y: f64,
    /// The sum of the squares of x about its mean, more than 0.
    pub xx: f64,
    /// The sum of the products of x and y about their means.
    pub xy: f64,
    /// The sum of the squares of y about its mean.
    pub yy: f64,
}

impl LineFit {
    /// Through (x, y); `None` where all stand at one x.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        Self::of(points.iter().map(|(x, y)| (*x, *y, 1.0)))
    }

    /// Through (x, y, weight); `None` where all that weigh stand at one x.
    pub fn weighted(points: &[(f64, f64, f64)]) -> Option<Self> {
        Self::of(points.iter().copied())
    }

    fn of(points: impl Iterator<Item = (f64, f64, f64)> + Clone) -> Option<Self> {
        let weight: f64 = points.clone().map(|(_, _, w)| w).sum();
        let mean_x = points.clone().map(|(x, _, w)| w * x).sum::<f64>() / weight;
        let mean_y = points.clone().map(|(_, y, w)| w * y).sum::<f64>() / weight;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for (x, y, w) in points {
            xx += w * (x - mean_x) * (x - mean_x);
            xy += w * (x - mean_x) * (y - mean_y);
            yy += w * (y - mean_y) * (y - mean_y);
        }
        (weight > 0.0 && xx > 0.0).then_some(Self {
            weight,
            mean_x,
            mean_y,
            xx,
            xy,
            yy,
        })
    }

    /// What y gains with each 1 of x.
    pub fn slope(&self) -> f64 {
        self.xy / self.xx
    }

    /// Its y at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.mean_y + self.slope() * (x - self.mean_x)
    }

    /// The x at which it has the value `y`; not finite where it is level.
    pub fn reaches(&self, y: f64) -> f64 {
        self.mean_x + (y - self.mean_y) / self.slope()
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
        let line = LineFit::weighted(&points).unwrap();
        assert!((line.slope() - 2.0).abs() < 1e-12);
        assert!((line.reaches(9.0) - 4.0).abs() < 1e-12);
        assert!((line.at(4.0) - 9.0).abs() < 1e-12);
        let alike = LineFit::through(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]);
        assert_eq!(alike, Some(line));
    }

    #[test]
    fn there_is_no_line_through_one_x() {
        assert_eq!(LineFit::weighted(&[(1.0, 2.0, 1.0); 5]), None);
        assert_eq!(LineFit::through(&[(1.0, 2.0), (1.0, 3.0)]), None);
        assert_eq!(LineFit::through(&[]), None);
    }
}
