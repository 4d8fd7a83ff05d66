//! Whole numbers as people type them.

/// The number that `text` writes with digits, underscores between digits and an exponent: `20000`, `20_000`, `2e4` or `2.5e3`. Nothing, if it
/// is no whole number, or none below 2⁶⁴.
#[must_use]
pub fn whole(text: &str) -> Option<u64> {
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    if mantissa.contains('.') && (fraction.is_empty() || exponent == "0") {
        return None;
    }
    let exponent: usize = exponent
        .strip_prefix('+')
        .unwrap_or(exponent)
        .parse()
        .ok()?;
    let fraction_digits = if fraction.is_empty() {
        String::new()
    } else {
        digits(fraction)?
    };
    let zeros = exponent.checked_sub(fraction_digits.len())?;
    let significant = digits(whole)? + &fraction_digits;
    let factor = 10_u64.checked_pow(u32::try_from(zeros).ok()?)?;
    significant.parse::<u64>().ok()?.checked_mul(factor)
}

/// `text` without the underscores between its digits; nothing, if anything else stands in it.
fn digits(text: &str) -> Option<String> {
    let groups = text.split('_');
    let is_number =
        |group: &str| !group.is_empty() && group.bytes().all(|byte| byte.is_ascii_digit());
    groups
        .map(|group| is_number(group).then_some(group))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_they_are_typed() {
        for (text, number) in [
            ("0", 0),
            ("007", 7),
            ("20000", 20_000),
            ("20_000", 20_000),
            ("2e4", 20_000),
            ("1E6", 1_000_000),
            ("1e+6", 1_000_000),
            ("2.5e6", 2_500_000),
            ("1_000e3", 1_000_000),
            ("0e9", 0),
            ("18446744073709551615", u64::MAX),
        ] {
            assert_eq!(whole(text), Some(number), "{text}");
        }
    }

    #[test]
    fn what_is_no_whole_number_is_refused() {
        for text in [
            "",
            "_",
            "1_",
            "_1",
            "1__0",
            "-1",
            "+1",
            "1.5",
            "1.",
            "1.5e0",
            "2.50e1",
            ".5e1",
            "1e",
            "e6",
            "1e-3",
            "1e99",
            "0x10",
            "1 000",
            "1,000",
            "18446744073709551616",
            "1e20",
            "NaN",
            "inf",
        ] {
            assert_eq!(whole(text), None, "{text}");
        }
    }
}
