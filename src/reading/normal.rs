//! Quantiles of the normal distribution, and of chi squared with one degree of freedom, to four figures.

/// The median size of a normal variable, in standard deviations.
pub const NORMAL_MEDIAN: f64 = 0.6745;
/// The standard deviation of a normal variable, in median sizes.
pub const DEVIATION_PER_MEDIAN: f64 = 1.4826;
/// Half the width of the interval that holds 90 % of a normal variable, in standard deviations.
pub const HALF_WIDTH_90: f64 = 1.645;
/// Half the width of the interval that holds 95 %.
pub const HALF_WIDTH_95: f64 = 1.960;
/// The 90 % quantile of chi squared with one degree of freedom: so much does twice the log-likelihood fall to the ends of a 90 % interval.
pub const CHI_SQUARED_90: f64 = 2.706;
