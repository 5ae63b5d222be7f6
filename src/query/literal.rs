//! Numbers of a question as polars reads them.

use sqlparser::dialect::GenericDialect;
use sqlparser::tokenizer::{Token, Tokenizer};

/// The same question with numbers such as `1e-3` written out, which polars does not read.
///
/// What is no SQL is left as it is, for whoever reads it to complain.
pub fn written_out(sql: &str) -> String {
    let Ok(tokens) = Tokenizer::new(&GenericDialect {}, sql).with_unescape(false).tokenize() else {
        return sql.to_owned();
    };
    tokens.iter().map(|token| plain(token).unwrap_or_else(|| token.to_string())).collect()
}

/// A number with an exponent, without one.
fn plain(token: &Token) -> Option<String> {
    let Token::Number(digits, _) = token else { return None };
    let value: f64 = digits.parse().ok().filter(|_| digits.contains(['e', 'E']))?;
    let text = value.is_finite().then(|| format!("{value}"))?;
    // Without a point it would be a whole number, of at most 64 bits.
    Some(if text.contains('.') { text } else { format!("{text}.0") })
}

#[cfg(test)]
mod tests {
    //! Numbers change their spelling, and nothing else does.

    use super::written_out;

    #[test]
    fn exponents_are_written_out() {
        for (sql, expected) in [
            ("SELECT gap FROM gap WHERE gap < 1e-3", "SELECT gap FROM gap WHERE gap < 0.001"),
            ("v > 1E5 AND v<=2.5e+6", "v > 100000.0 AND v<=2500000.0"),
            ("a1e3 = '1e3' -- 1e3\n/* 1e3 */ \"1e3\"", "a1e3 = '1e3' -- 1e3\n/* 1e3 */ \"1e3\""),
            ("'it''s' = 1.5", "'it''s' = 1.5"),
            ("'unclosed", "'unclosed"),
        ] {
            assert_eq!(written_out(sql), expected);
        }
    }
}
