//! Messages on stdin and stdout: a header with the length, then JSON.
//!
//! In: bytes. Out: messages, or the reason why there is none. Invariant: no memory is reserved for a length that is merely
//! announced; after bytes that are no message, reading goes on at the next `Content-Length:`, also of one that a wrong length
//! has cut or swallowed.
//! Microsoft, *Language Server Protocol Specification 3.17*; JSON-RPC Working Group, *JSON-RPC 2.0 Specification*.

use lsp_server::{ErrorCode, Message};
use serde_json::{Value, json};
use std::io::{BufRead, Cursor, Read, Result, Write};

/// The largest message, in bytes.
const MOST_BYTES: u64 = 64 * 1024 * 1024;

/// The longest line of a header.
const MOST_LINE: u64 = 8 * 1024;

/// The beginning of a message.
const LENGTH: &[u8] = b"content-length:";

/// What is read.
pub(super) enum Incoming {
    Message(Message),
    /// A message that cannot be read; its id, or null.
    Malformed(Value, ErrorCode, String),
    /// An answer to a request: the server sends none.
    Answer,
    End,
}

/// A stream of which bytes can be read again.
struct Again<R> {
    back: Cursor<Vec<u8>>,
    from: R,
}

impl<R: BufRead> Again<R> {
    /// These bytes are read next. All that were put back before have been read.
    fn put_back(&mut self, bytes: &[u8]) {
        let rest = self.back.fill_buf().map(<[u8]>::to_vec).unwrap_or_default();
        self.back = Cursor::new([bytes, &rest].concat());
    }
}

impl<R: BufRead> Read for Again<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        match self.back.read(into)? {
            0 => self.from.read(into),
            count => Ok(count),
        }
    }
}

impl<R: BufRead> BufRead for Again<R> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        match self.back.fill_buf()?.is_empty() {
            true => self.from.fill_buf(),
            false => self.back.fill_buf(),
        }
    }

    fn consume(&mut self, count: usize) {
        match self.back.fill_buf().is_ok_and(|rest| !rest.is_empty()) {
            true => self.back.consume(count),
            false => self.from.consume(count),
        }
    }
}

/// The messages of a client, one after the other.
pub(super) struct Messages<R> {
    from: Again<R>,
    /// Whether the next message is yet to be found.
    is_lost: bool,
}

impl<R: BufRead> Messages<R> {
    pub(super) fn new(from: R) -> Self {
        Self { from: Again { back: Cursor::default(), from }, is_lost: false }
    }

    /// Reads a message.
    pub(super) fn read(&mut self) -> Result<Incoming> {
        if std::mem::take(&mut self.is_lost) && !self.find()? {
            return Ok(Incoming::End);
        }
        let length = match self.header()? {
            None => return Ok(Incoming::End),
            Some(Ok(length)) if length > MOST_BYTES => {
                self.is_lost = true;
                let reason = format!("a message of {length} bytes is longer than {MOST_BYTES}");
                return Ok(Incoming::Malformed(Value::Null, ErrorCode::InvalidRequest, reason));
            }
            Some(Ok(length)) => length,
            Some(Err(reason)) => {
                self.is_lost = true;
                return Ok(Incoming::Malformed(Value::Null, ErrorCode::ParseError, reason));
            }
        };
        let mut bytes = Vec::new();
        if (self.from.by_ref().take(length).read_to_end(&mut bytes)? as u64) < length {
            return Ok(Incoming::End);
        }
        let found = message(&bytes);
        if let Incoming::Malformed(_, ErrorCode::ParseError, _) = found {
            // The length may have been too large, or too small.
            self.is_lost = true;
            self.from.put_back(&bytes);
        }
        Ok(found)
    }

    /// The length that a header gives, or what is wrong with it; `None` at the end.
    fn header(&mut self) -> Result<Option<std::result::Result<u64, String>>> {
        let wrong = |reason: String| Ok(Some(Err(reason)));
        let (mut length, mut has_begun) = (None, false);
        loop {
            let mut bytes = Vec::new();
            if self.from.by_ref().take(MOST_LINE).read_until(b'\n', &mut bytes)? == 0 {
                return Ok(None);
            }
            let line = String::from_utf8_lossy(&bytes);
            let line = line.trim();
            match (line.split_once(':'), length) {
                (_, Some(length)) if line.is_empty() => return Ok(Some(Ok(length))),
                (_, None) if line.is_empty() && has_begun => {
                    return wrong("the header has no `Content-Length`".to_owned());
                }
                // Blank lines between messages.
                _ if line.is_empty() => {}
                (Some((name, value)), _) if name.eq_ignore_ascii_case("content-length") => {
                    match value.trim().parse() {
                        Ok(number) => length = Some(number),
                        Err(_) => return wrong(format!("`{}` is not a length", value.trim())),
                    }
                }
                (Some((name, _)), _)
                    if name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-') => {}
                _ => {
                    // A message may begin within the line.
                    self.from.put_back(&bytes);
                    return wrong("a line of the header is not `name: value`".to_owned());
                }
            }
            has_begun |= !line.is_empty();
        }
    }

    /// Passes over all bytes before the next `Content-Length:`; whether there is one.
    fn find(&mut self) -> Result<bool> {
        let mut last = Vec::new();
        while self.from.by_ref().take(MOST_LINE).read_until(b':', &mut last)? > 0 {
            last.drain(..last.len().saturating_sub(LENGTH.len()));
            if last.eq_ignore_ascii_case(LENGTH) {
                self.from.put_back(&last);
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// A message of its text.
fn message(bytes: &[u8]) -> Incoming {
    let value: Value = match serde_json::from_slice(bytes) {
        Ok(value) => value,
        Err(error) => return Incoming::Malformed(Value::Null, ErrorCode::ParseError, error.to_string()),
    };
    let is_id = |id: &Value| id.is_string() || id.as_i64().is_some_and(|id| i32::try_from(id).is_ok());
    let id = value.get("id").filter(|id| is_id(id)).cloned().unwrap_or_default();
    let invalid =
        |reason: &str| Incoming::Malformed(id.clone(), ErrorCode::InvalidRequest, reason.to_owned());
    let has_result = value.get("result").is_some() || value.get("error").is_some();
    match (value.get("method"), value.get("id")) {
        (Some(Value::String(_)), Some(given)) if !is_id(given) => {
            return invalid("the id of a request is a text or an integer");
        }
        (Some(Value::String(_)), _) => {}
        (None, _) if has_result => return Incoming::Answer,
        _ => return invalid("this is neither a request nor a notification"),
    }
    serde_json::from_value(value).map_or_else(|error| invalid(&error.to_string()), Incoming::Message)
}

/// Writes an error about a message that cannot be read.
pub(super) fn refuse(out: &mut impl Write, id: &Value, code: ErrorCode, reason: &str) -> Result<()> {
    let error = json!({ "code": code as i32, "message": reason });
    let text = json!({ "jsonrpc": "2.0", "id": id, "error": error }).to_string();
    write!(out, "Content-Length: {}\r\n\r\n{text}", text.len())?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: &str = r#"{"jsonrpc":"2.0","method":"initialized","params":{}}"#;

    fn frame(text: &str) -> String {
        format!("Content-Length: {}\r\n\r\n{text}", text.len())
    }

    /// The codes of errors, 0 for a message, until the end.
    fn codes(parts: &[&str]) -> Vec<i32> {
        let text = parts.concat();
        let mut messages = Messages::new(text.as_bytes());
        let mut found = Vec::new();
        loop {
            match messages.read().unwrap() {
                Incoming::Malformed(_, code, _) => found.push(code as i32),
                Incoming::Message(_) => found.push(0),
                Incoming::Answer => found.push(1),
                Incoming::End => return found,
            }
        }
    }

    #[test]
    fn a_message_is_read_after_one_that_cannot_be() {
        let right = frame(RIGHT);
        assert_eq!(codes(&[&frame("{"), &frame("[1]"), "nonsense\r\n", &right]), [-32700, -32600, -32700, 0]);
        // A length that is too small, one that is too large, none, and one without a body.
        let small = right.replace("52", "20");
        assert_eq!(codes(&[&small, &right, &right]), [-32700, 0, 0]);
        let large = right.replace("52", "60");
        assert_eq!(codes(&[&large, &right, &right]), [-32700, 0, 0]);
        let without = format!("Content-Type: application/json\r\n\r\n{RIGHT}");
        assert_eq!(codes(&[&without, &right, &right]), [-32700, 0, 0]);
        assert_eq!(codes(&["Content-Length: 0\r\n\r\n", &right]), [-32700, 0]);
        // Longer than a line of a header.
        assert_eq!(codes(&[&"{:".repeat(10_000), &right]), [-32700, 0]);
    }

    #[test]
    fn a_message_that_no_client_sends_is_refused() {
        let code = |text: &str| codes(&[&frame(text)])[0];
        for id in ["{}", "[]", "null", "true", "1.5", "99999999999"] {
            assert_eq!(code(&format!(r#"{{"id":{id},"method":"shutdown"}}"#)), -32600, "{id}");
        }
        assert_eq!(code(r#"{"id":1,"method":2}"#), -32600);
        assert_eq!(code(r#"{"id":1}"#), -32600);
        assert_eq!(code(r#"{"id":1,"result":2}"#), 1);
        assert_eq!(code(r#"{"id":null,"error":{"code":1,"message":""}}"#), 1);
    }

    #[test]
    fn an_announced_length_is_not_reserved() {
        let long = "Content-Length: 18446744073709551615\r\n\r\n{}";
        assert_eq!(codes(&[long, &frame(RIGHT)]), [-32600, 0]);
    }
}
