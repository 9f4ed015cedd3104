//! The secret in the page's address, without which no request is answered.

use crate::failure::Failure;
use std::fmt::Write;

/// Random bytes of a token.
const BYTES: usize = 16;

/// A secret of 32 hexadecimal digits.
#[derive(Clone, Debug)]
pub struct Token(String);

impl Token {
    /// A new token from the system's random numbers.
    ///
    /// # Errors
    /// When the system has no random numbers.
    pub fn random() -> Result<Token, Failure> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes)
            .map_err(|error| Failure::input(format!("no random numbers: {error}")))?;
        let mut digits = String::new();
        for byte in bytes {
            // Writing into a string does not fail.
            let _ = write!(digits, "{byte:02x}");
        }
        Ok(Token(digits))
    }

    /// Its digits.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// The rest of a path behind `/TOKEN`; `None` if the token is missing or wrong. Takes equally
    /// long for every token of the right length, and the time reveals nothing about it.
    pub fn rest<'p>(&self, path: &'p str) -> Option<&'p str> {
        let (digits, rest) = path.strip_prefix('/')?.split_at_checked(self.0.len())?;
        let differences = digits.bytes().zip(self.0.bytes());
        let difference = differences.fold(0, |sum, (given, own)| sum | given ^ own);
        (difference == 0 && rest.starts_with('/')).then_some(rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_and_open_only_their_own_paths() {
        let [token, other] = [(); 2].map(|()| Token::random().unwrap());
        assert_ne!(token.text(), other.text());
        assert_eq!(token.text().len(), 32);
        let path = |token: &Token, rest: &str| format!("/{}{rest}", token.text());
        assert_eq!(token.rest(&path(&token, "/")), Some("/"));
        assert_eq!(token.rest(&path(&token, "/a/b")), Some("/a/b"));
        assert_eq!(token.rest(&path(&token, "")), None);
        assert_eq!(token.rest(&path(&token, "0/")), None);
        assert_eq!(token.rest(&path(&other, "/")), None);
        for path in ["", "/", "/x", "//", "/ü".repeat(40).as_str()] {
            assert_eq!(token.rest(path), None, "{path}");
        }
    }
}
