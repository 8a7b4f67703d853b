//! The value of a calculation as a page writes it.
//!
//! In: text such as `0.5 * 0.9^2 / (1 - exp(-2))`. Out: its value. Invariant: nothing of bp-core is used, so that a page is
//! checked by other code than the code that it describes.

/// The value of a calculation with `+ - * / ^`, parentheses, numbers, `pi`, `exp`, `ln`, `sqrt`, `sin` and `cos`.
pub(crate) fn value(text: &str) -> Result<f64, String> {
    let mut rest = Rest { text, at: 0 };
    let found = rest.sum()?;
    match rest.peek() {
        None => Ok(found),
        Some(other) => Err(format!("`{other}` in `{text}`")),
    }
}

struct Rest<'t> {
    text: &'t str,
    at: usize,
}

impl Rest<'_> {
    /// The next character that is not blank.
    fn peek(&mut self) -> Option<char> {
        let blanks = self.text[self.at..].len() - self.text[self.at..].trim_start().len();
        self.at += blanks;
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += if found { wanted.len_utf8() } else { 0 };
        found
    }

    fn sum(&mut self) -> Result<f64, String> {
        let mut total = self.product()?;
        loop {
            if self.take('+') {
                total += self.product()?;
            } else if self.take('-') {
                total -= self.product()?;
            } else {
                return Ok(total);
            }
        }
    }

    fn product(&mut self) -> Result<f64, String> {
        let mut total = self.signed()?;
        loop {
            if self.take('*') {
                total *= self.signed()?;
            } else if self.take('/') {
                total /= self.signed()?;
            } else {
                return Ok(total);
            }
        }
    }

    /// A sign binds less than a power: -2^2 is -4.
    fn signed(&mut self) -> Result<f64, String> {
        match self.take('-') {
            true => Ok(-self.signed()?),
            false => self.power(),
        }
    }

    fn power(&mut self) -> Result<f64, String> {
        let base = self.atom()?;
        match self.take('^') {
            true => Ok(base.powf(self.signed()?)),
            false => Ok(base),
        }
    }

    fn atom(&mut self) -> Result<f64, String> {
        if self.take('(') {
            let inside = self.sum()?;
            return match self.take(')') {
                true => Ok(inside),
                false => Err(format!("a `(` of `{}` is not closed", self.text)),
            };
        }
        self.peek();
        let from = self.at;
        let is_word = |character: char| character.is_ascii_alphanumeric() || character == '.';
        self.at += self.text[from..].chars().take_while(|character| is_word(*character)).count();
        let word = &self.text[from..self.at];
        let function: fn(f64) -> f64 = match word {
            "pi" => return Ok(std::f64::consts::PI),
            "exp" => f64::exp,
            "ln" => f64::ln,
            "sqrt" => f64::sqrt,
            "sin" => f64::sin,
            "cos" => f64::cos,
            _ => return word.parse().map_err(|_| format!("`{word}` in `{}` is not a number", self.text)),
        };
        match self.peek() {
            Some('(') => Ok(function(self.atom()?)),
            _ => Err(format!("`{word}` of `{}` has no argument", self.text)),
        }
    }
}

#[test]
fn calculations_have_their_values() {
    for (text, expected) in [
        ("1 + 2 * 3", 7.0),
        ("-2^2 / (1 + 1)", -2.0),
        ("2 - 3 - 4", -5.0),
        ("2^3^2", 512.0),
        ("sqrt(16)", 4.0),
    ] {
        assert_eq!(value(text), Ok(expected), "{text}");
    }
    assert!((value("-ln(exp(2)) * sin(pi / 2)").unwrap() + 2.0).abs() < 1e-15);
    for wrong in ["1 +", "(1", "two", "ln 2", "1 2"] {
        assert!(value(wrong).is_err(), "{wrong}");
    }
}
