//! What it means that readings are rounded.

/// A value of about a unit of the last digit is whole within this, however it was computed.
const NO_DIGIT: f64 = 1e-6;

/// Whether a value is a whole number, but for the last digits of arithmetic.
pub(super) fn is_whole(value: f64) -> bool {
    (value - value.round()).abs() < NO_DIGIT
}

/// The standard error of a value that is rounded to a multiple of `step`, in the unit of `step`: that of an even distribution over one step.
pub fn rounding_error(step: f64) -> f64 {
    step / 12.0_f64.sqrt()
}
