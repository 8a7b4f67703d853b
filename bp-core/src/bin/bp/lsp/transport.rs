//! Messages on stdin and stdout: a header with the length, then JSON.
//!
//! In: bytes. Out: messages, or the reason why there is none. Invariant: no memory is reserved for a length that is merely
//! announced; after a message that cannot be read, the next one is read.
//! Microsoft, *Language Server Protocol Specification 3.17*; JSON-RPC Working Group, *JSON-RPC 2.0 Specification*.

use lsp_server::{ErrorCode, Message};
use serde_json::{Value, json};
use std::io::{BufRead, Read, Result, Write};

/// The largest message, in bytes.
const MOST_BYTES: u64 = 64 * 1024 * 1024;

/// The longest line of a header.
const MOST_LINE: u64 = 8 * 1024;

/// What is read.
pub(super) enum Incoming {
    Message(Message),
    /// A message that cannot be read; its id, or null.
    Malformed(Value, ErrorCode, String),
    /// A message that is too long: the number of its bytes, which [`pass_over`] skips, and the reason.
    TooLong(u64, String),
    End,
}

/// Reads a message.
pub(super) fn read(from: &mut impl BufRead) -> Result<Incoming> {
    let malformed = |reason: String| Ok(Incoming::Malformed(Value::Null, ErrorCode::ParseError, reason));
    let mut length = None;
    loop {
        let mut line = Vec::new();
        if from.by_ref().take(MOST_LINE).read_until(b'\n', &mut line)? == 0 {
            return Ok(Incoming::End);
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim();
        match (line.split_once(':'), length) {
            _ if line.is_empty() && length.is_some() => break,
            // Blank lines between messages.
            _ if line.is_empty() => {}
            (Some((name, value)), _) if name.trim().eq_ignore_ascii_case("content-length") => {
                match value.trim().parse::<u64>() {
                    Ok(number) => length = Some(number),
                    Err(_) => return malformed(format!("`{}` is not a length", value.trim())),
                }
            }
            (Some(_), _) => {}
            (None, _) => return malformed("a line of the header has no `:`".to_owned()),
        }
    }
    let length = length.unwrap_or(0);
    if length > MOST_BYTES {
        let reason = format!("a message of {length} bytes is longer than {MOST_BYTES}");
        return Ok(Incoming::TooLong(length, reason));
    }
    let mut bytes = Vec::new();
    if (from.by_ref().take(length).read_to_end(&mut bytes)? as u64) < length {
        return Ok(Incoming::End);
    }
    Ok(message(&bytes))
}

/// A message of its text.
fn message(bytes: &[u8]) -> Incoming {
    let value: Value = match serde_json::from_slice(bytes) {
        Ok(value) => value,
        Err(error) => return Incoming::Malformed(Value::Null, ErrorCode::ParseError, error.to_string()),
    };
    let id = value.get("id").filter(|id| id.is_number() || id.is_string()).cloned().unwrap_or_default();
    match serde_json::from_value(value) {
        Ok(message) => Incoming::Message(message),
        Err(_) => {
            let reason = "this is neither a request nor a notification".to_owned();
            Incoming::Malformed(id, ErrorCode::InvalidRequest, reason)
        }
    }
}

/// Reads this number of bytes and drops them.
pub(super) fn pass_over(from: &mut impl BufRead, length: u64) -> Result<()> {
    std::io::copy(&mut from.take(length), &mut std::io::sink()).map(drop)
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

    #[test]
    fn a_message_is_read_after_one_that_cannot_be() {
        let right = r#"{"jsonrpc":"2.0","method":"initialized","params":{}}"#;
        let frame = |text: &str| format!("Content-Length: {}\r\n\r\n{text}", text.len());
        let text = [frame("{"), frame("[1]"), "nonsense\r\n".to_owned(), frame(right)].concat();
        let mut bytes = text.as_bytes();
        let mut code = || match read(&mut bytes).unwrap() {
            Incoming::Malformed(_, code, _) => code as i32,
            Incoming::Message(_) => 0,
            Incoming::End => 1,
            Incoming::TooLong(..) => 2,
        };
        assert_eq!([code(), code(), code(), code(), code()], [-32700, -32600, -32700, 0, 1]);
    }

    #[test]
    fn an_announced_length_is_not_reserved() {
        let mut bytes = &b"Content-Length: 18446744073709551615\r\n\r\n{}"[..];
        let Incoming::TooLong(length, _) = read(&mut bytes).unwrap() else { panic!("it was read") };
        assert_eq!(length, u64::MAX);
        pass_over(&mut bytes, 1).unwrap();
        assert_eq!(bytes, b"}");
    }
}
