//! `bp lsp`, by a scripted client.
//!
//! In: messages of the protocol. Out: its answers. Positions: by hand, in UTF-16.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const URI: &str = "file:///grass.bp";

/// 𝛼 is two units of UTF-16, and four bytes.
const GRASS: &str = "/// 𝛼 Is it the rain?
program Grass {
    parameters { rate : probability = 0.3; } // probability of rain
    variables { Rain, \"Wet 𝛼\" : bool; Place : { Paris, Nice }; }
    decomposition { P(Rain) P(\"Wet 𝛼\" | Rain) P(Place) }
    forms {
        P(Rain) = bernoulli(rate);
        P(\"Wet 𝛼\" | Rain) = bernoulli(if Rain { 0.9 } else { 0.1 });
        P(Place) = uniform;
    }
    question rain { P(Rain | \"Wet 𝛼\" = true) }
}
";

struct Client {
    server: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    asked: u64,
}

impl Client {
    /// A server that is initialised and has the document open; and its diagnostics.
    fn opened(text: &str) -> (Self, Value) {
        let mut server = Command::new(env!("CARGO_BIN_EXE_bp"))
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (to, from) = (server.stdin.take().unwrap(), BufReader::new(server.stdout.take().unwrap()));
        let mut client = Self { server, to, from, asked: 0 };
        let begun = client.ask("initialize", json!({ "capabilities": {} }));
        assert_eq!(begun["capabilities"]["positionEncoding"], "utf-16");
        client.tell("initialized", json!({}));
        let document = json!({ "uri": URI, "languageId": "bp", "version": 1, "text": text });
        client.tell("textDocument/didOpen", json!({ "textDocument": document }));
        let found = client.read();
        assert_eq!(found["method"], "textDocument/publishDiagnostics");
        (client, found["params"]["diagnostics"].clone())
    }

    /// The diagnostics of another text.
    fn change(&mut self, text: &str) -> Value {
        let document = json!({ "uri": URI, "version": 2 });
        let changes = json!([{ "text": text }]);
        self.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": changes }));
        self.read()["params"]["diagnostics"].clone()
    }

    fn write(&mut self, message: &Value) {
        let text = message.to_string();
        write!(self.to, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        self.to.flush().unwrap();
    }

    fn read(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            assert!(self.from.read_line(&mut line).unwrap() > 0, "the server has ended");
            match line.trim().split_once(": ") {
                Some(("Content-Length", number)) => length = number.parse().unwrap(),
                Some(_) => {}
                None => break,
            }
        }
        let mut bytes = vec![0; length];
        self.from.read_exact(&mut bytes).unwrap();
        serde_json::from_slice(&bytes).unwrap()
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.write(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// The whole response.
    fn response(&mut self, method: &str, params: Value) -> Value {
        self.asked += 1;
        self.write(&json!({ "jsonrpc": "2.0", "id": self.asked, "method": method, "params": params }));
        let response = self.read();
        assert_eq!(response["id"], self.asked);
        response
    }

    #[track_caller]
    fn ask(&mut self, method: &str, params: Value) -> Value {
        let response = self.response(method, params);
        assert!(response.get("error").is_none(), "{response}");
        response["result"].clone()
    }

    fn at(&mut self, method: &str, line: u32, character: u32) -> Value {
        self.ask(method, place(line, character))
    }

    /// The message of an error.
    #[track_caller]
    fn refused(&mut self, method: &str, params: Value) -> String {
        let response = self.response(method, params);
        response["error"]["message"].as_str().unwrap_or_else(|| panic!("{response}")).to_owned()
    }

    fn end(mut self) {
        self.ask("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        assert!(self.server.wait().unwrap().success());
    }
}

fn place(line: u32, character: u32) -> Value {
    json!({ "textDocument": { "uri": URI }, "position": { "line": line, "character": character } })
}

fn range(line: u32, from: u32, to: u32) -> Value {
    json!({ "start": { "line": line, "character": from }, "end": { "line": line, "character": to } })
}

/// A text with edits, each on one line.
fn edited(text: &str, edits: &Value) -> String {
    let mut edits = edits.as_array().unwrap().clone();
    let number = |place: &Value, key: &str| place[key].as_u64().unwrap() as usize;
    edits.sort_by_key(|edit| {
        let start = &edit["range"]["start"];
        std::cmp::Reverse((number(start, "line"), number(start, "character")))
    });
    let mut lines: Vec<Vec<u16>> = text.split('\n').map(|line| line.encode_utf16().collect()).collect();
    for edit in edits {
        let (start, end) = (&edit["range"]["start"], &edit["range"]["end"]);
        let new: Vec<u16> = edit["newText"].as_str().unwrap().encode_utf16().collect();
        let line = &mut lines[number(start, "line")];
        line.splice(number(start, "character")..number(end, "character"), new);
    }
    let lines: Vec<String> = lines.iter().map(|line| String::from_utf16(line).unwrap()).collect();
    lines.join("\n")
}

#[test]
fn mistakes_are_under_their_words_and_go_when_they_are_mended() {
    let wrong = GRASS.replace("P(Rain) = bern", "P(\"Wet 𝛼\" Rian) = bern");
    let (mut client, found) = Client::opened(&wrong);
    let names_it = |one: &&Value| one["message"].as_str().unwrap().contains("Rian");
    let first = found.as_array().unwrap().iter().find(names_it).unwrap_or_else(|| panic!("{found}"));
    // After eight blanks: `P(`, a quoted name of 7 characters with 8 units, a blank, `Rian)`.
    assert_eq!(first["range"], range(6, 8, 8 + 2 + 8 + 1 + 5), "{first}");
    assert_eq!(client.change(GRASS), json!([]));
    assert!(!client.change("program Grass {").as_array().unwrap().is_empty());
    client.end();
}

#[test]
fn names_show_their_declaration_and_forms_their_reference() {
    let (mut client, _) = Client::opened(GRASS);
    let rain = client.at("textDocument/hover", 6, 11);
    let text = rain["contents"]["value"].as_str().unwrap();
    assert!(text.contains("Rain : bool") && text.contains("P(Rain) = bernoulli(rate);"), "{text}");
    assert_eq!(rain["range"], range(6, 10, 14));
    let rate = client.at("textDocument/hover", 6, 29);
    assert!(rate["contents"]["value"].as_str().unwrap().contains("rate : probability = 0.3;"), "{rate}");
    let grass = client.at("textDocument/hover", 1, 10);
    assert!(grass["contents"]["value"].as_str().unwrap().contains("𝛼 Is it the rain?"), "{grass}");
    let form = client.at("textDocument/hover", 6, 20);
    // The words of `bp reference bernoulli`, whose lines are broken elsewhere.
    let output = Command::new(env!("CARGO_BIN_EXE_bp")).args(["reference", "bernoulli"]).output().unwrap();
    let reference = String::from_utf8(output.stdout).unwrap();
    let words = |text: &str| {
        text.split(|c: char| !c.is_alphanumeric())
            .filter(|word| !word.is_empty())
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let shown = words(form["contents"]["value"].as_str().unwrap());
    let printed = words(&reference);
    assert!(printed.len() > 10 && printed.iter().all(|word| shown.contains(word)), "{form}");
    assert_eq!(client.at("textDocument/hover", 5, 0), Value::Null);
    // Beyond the end.
    assert_eq!(client.at("textDocument/hover", 99, 99), Value::Null);
    client.end();
}

#[test]
fn definitions_and_uses_are_found_in_utf_16() {
    let (mut client, _) = Client::opened(GRASS);
    let wet = client.at("textDocument/definition", 7, 12);
    assert_eq!(wet["range"], range(3, 22, 30));
    let uses = client.ask("textDocument/references", {
        let mut params = place(3, 17);
        params["context"] = json!({ "includeDeclaration": true });
        params
    });
    // Rain: declared, in two factors, in two forms and a condition, in the question.
    assert_eq!(uses.as_array().unwrap().len(), 7);
    let outline = client.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": URI } }));
    let names: Vec<&str> =
        outline.as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["Grass", "rate", "Rain", "Wet 𝛼", "Place", "rain"]);
    client.end();
}

#[test]
fn renaming_changes_every_use_and_keeps_the_program() {
    let (mut client, _) = Client::opened(GRASS);
    let named = |name: &str| {
        let mut params = place(4, 30);
        params["newName"] = json!(name);
        params
    };
    assert_eq!(client.at("textDocument/prepareRename", 4, 30)["placeholder"], "Wet 𝛼");
    let edits = client.ask("textDocument/rename", named("Damp"))["changes"][URI].clone();
    assert_eq!(edits.as_array().unwrap().len(), 4);
    let text = edited(GRASS, &edits);
    assert_eq!(text, GRASS.replace("\"Wet 𝛼\"", "Damp"));
    assert_eq!(client.change(&text), json!([]));
    client.change(GRASS);
    assert_eq!(client.refused("textDocument/rename", named("Rain")), "`Rain` is already in use");
    assert_eq!(client.refused("textDocument/rename", named("two words")), "`two words` is not a name");
    assert!(
        client.refused("textDocument/rename", named("match")).starts_with("`match` does not fit everywhere")
    );
    client.end();
}

#[test]
fn completion_offers_names_forms_and_words() {
    let (mut client, _) = Client::opened(GRASS);
    let items = client.at("textDocument/completion", 6, 18);
    let labels: Vec<&str> =
        items.as_array().unwrap().iter().map(|item| item["label"].as_str().unwrap()).collect();
    for wanted in ["Rain", "rate", "Nice", "bernoulli", "gamma", "previous", "argmax"] {
        assert!(labels.contains(&wanted), "{wanted}");
    }
    // They stay while a line is being typed.
    client.change(&GRASS.replace("= uniform;", "= "));
    let items = client.at("textDocument/completion", 8, 19);
    assert!(items.as_array().unwrap().iter().any(|item| item["label"] == "Rain"));
    client.end();
}

#[test]
fn formatting_is_that_of_the_command() {
    let untidy = GRASS.replace("    question rain { ", "  question rain{");
    let (mut client, _) = Client::opened(&untidy);
    let params = json!({ "textDocument": { "uri": URI }, "options": { "tabSize": 4, "insertSpaces": true } });
    let edits = client.ask("textDocument/formatting", params.clone());
    let mut command = Command::new(env!("CARGO_BIN_EXE_bp"))
        .args(["fmt", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    command.stdin.take().unwrap().write_all(untidy.as_bytes()).unwrap();
    let expected = String::from_utf8(command.wait_with_output().unwrap().stdout).unwrap();
    assert_eq!(edits[0]["newText"], expected);
    client.change(&expected);
    assert_eq!(client.ask("textDocument/formatting", params), json!([]));
    client.end();
}

#[test]
fn wrong_requests_are_refused_and_the_server_goes_on() {
    let (mut client, _) = Client::opened(GRASS);
    assert!(client.refused("textDocument/foldingRange", json!({})).contains("is not supported"));
    let mut elsewhere = place(0, 0);
    elsewhere["textDocument"]["uri"] = json!("file:///other.bp");
    assert!(client.refused("textDocument/hover", elsewhere).contains("is not open"));
    assert!(!client.refused("textDocument/hover", json!({ "position": 3 })).is_empty());
    client.tell("textDocument/didChange", json!({ "nothing": true }));
    assert_ne!(client.at("textDocument/hover", 6, 11), Value::Null);
    client.end();
}

#[test]
fn malformed_messages_are_answered_and_the_server_goes_on() {
    let (mut client, _) = Client::opened(GRASS);
    for (text, code) in [("{", -32700), ("[]", -32600), ("{\"jsonrpc\":\"2.0\"}", -32600), ("\u{0}", -32700)]
    {
        write!(client.to, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        let found = client.read();
        assert_eq!((&found["error"]["code"], &found["id"]), (&json!(code), &Value::Null), "{text}: {found}");
    }
    write!(client.to, "Content-Length: seven\r\n").unwrap();
    assert_eq!(client.read()["error"]["code"], -32700);
    client.write(&json!({ "jsonrpc": "2.0", "id": 9, "result": 1, "methods": 3 }));
    assert_ne!(client.at("textDocument/hover", 6, 11), Value::Null);
    client.end();
}

#[test]
fn a_request_is_found_after_what_is_no_message() {
    let request = r#"{"jsonrpc":"2.0","id":7,"method":"shutdown"}"#;
    let other_id = request.replace(":7", ":{}");
    for (bytes, code) in [
        (format!("Content-Length: {}\r\n\r\n{other_id}", other_id.len()), -32600),
        // Only announced; too short, so that the rest of the message follows; too long, so that it takes a part of the next.
        ("Content-Length: 99999999999999\r\n\r\n".to_owned(), -32600),
        (format!("Content-Length: {}\r\n\r\n{request}", request.len() - 9), -32700),
        (format!("Content-Length: {}\r\n\r\n{request}", request.len() + 9), -32700),
        (format!("Content-Type: application/json\r\n\r\n{request}"), -32700),
        (format!("{request}\r\n"), -32700),
    ] {
        let (mut client, _) = Client::opened(GRASS);
        client.to.write_all(bytes.as_bytes()).unwrap();
        client.write(&json!({ "jsonrpc": "2.0", "id": 8, "method": "shutdown" }));
        let found = client.read();
        assert_eq!((&found["error"]["code"], &found["id"]), (&json!(code), &Value::Null), "{bytes}: {found}");
        assert_eq!(client.read()["id"], 8, "{bytes}");
        client.tell("exit", Value::Null);
        assert!(client.server.wait().unwrap().success());
    }
}

#[test]
fn a_session_begins_and_ends_as_the_protocol_has_it() {
    let start = || {
        let command = &mut Command::new(env!("CARGO_BIN_EXE_bp"));
        let piped = command.arg("lsp").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut server = piped.spawn().unwrap();
        let (to, from) = (server.stdin.take().unwrap(), BufReader::new(server.stdout.take().unwrap()));
        Client { server, to, from, asked: 0 }
    };
    let mut early = start();
    let response = early.response("shutdown", Value::Null);
    assert_eq!(response["error"]["code"], -32002, "{response}");
    early.tell("exit", Value::Null);
    assert_eq!(early.server.wait().unwrap().code(), Some(1));
    let (mut client, _) = Client::opened(GRASS);
    assert_eq!(client.response("initialize", json!({ "capabilities": {} }))["error"]["code"], -32600);
    client.ask("shutdown", Value::Null);
    assert_eq!(client.response("textDocument/hover", place(6, 11))["error"]["code"], -32600);
    client.tell("exit", Value::Null);
    assert_eq!(client.server.wait().unwrap().code(), Some(0));
    let (mut client, _) = Client::opened(GRASS);
    client.tell("exit", Value::Null);
    assert_eq!(client.server.wait().unwrap().code(), Some(1));
}

#[test]
fn the_grammar_of_textmate_has_the_words_of_the_language() {
    let output = Command::new(env!("CARGO_BIN_EXE_bp")).args(["lsp", "--grammar"]).output().unwrap();
    let grammar: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(grammar["scopeName"], "source.bp");
    let patterns = grammar["patterns"].as_array().unwrap();
    let of = |name: &str| patterns.iter().find(|one| one["name"] == name).unwrap()["match"].as_str().unwrap();
    assert!(
        ["program", "decomposition", "question"].iter().all(|word| of("keyword.control.bp").contains(word))
    );
    assert_eq!(of("comment.line.double-slash.bp"), "//.*$");
    assert_eq!(of("constant.language.bp"), "\\b(?:true|false)\\b");
}
