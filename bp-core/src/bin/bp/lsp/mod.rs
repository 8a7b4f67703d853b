//! `bp lsp`: a language server, for editors.
//!
//! In: messages of the Language Server Protocol on stdin. Out: answers on stdout: diagnostics, hover, completion,
//! definitions, renaming, formatting. Invariant: positions are in UTF-16, as the protocol has them; a request that cannot be
//! answered is an error response, and the server goes on.

mod document;
mod edit;
mod grammar;
mod hover;
mod symbols;
mod transport;

use crate::failure::Failure;
use crate::program::warn;
use document::Document;
use lsp_server::{ErrorCode, Message, Notification, Request, Response};
use lsp_types::notification::{
    DidChangeTextDocument, DidCloseTextDocument, DidOpenTextDocument, Exit, Notification as _,
    PublishDiagnostics,
};
use lsp_types::request::{
    Completion, DocumentSymbolRequest, Formatting, GotoDefinition, HoverRequest, Initialize,
    PrepareRenameRequest, References, Rename, Request as _, Shutdown,
};
use lsp_types::{
    HoverProviderCapability, OneOf, PositionEncodingKind, PublishDiagnosticsParams, RenameOptions,
    ServerCapabilities, TextDocumentPositionParams, TextDocumentSyncCapability, TextDocumentSyncKind, Uri,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use transport::{Incoming, Messages};

/// Serve an editor: diagnostics, hover, completion, definitions, renaming, formatting.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp lsp                 (an editor starts it and speaks to it on stdin and stdout)

In Neovim:
  vim.lsp.start({ name = 'bp', cmd = { 'bp', 'lsp' } })

In Helix, languages.toml:
  [language-server.bp]
  command = 'bp'
  args = ['lsp']

  bp lsp --grammar > bp.tmLanguage.json     (colours, for editors that take TextMate)")]
pub(crate) struct Arguments {
    /// The only transport; some clients pass it.
    #[arg(long)]
    stdio: bool,
    /// Print the TextMate grammar of the language.
    #[arg(long)]
    grammar: bool,
}

/// The open documents, by their addresses.
type Open = BTreeMap<String, Document>;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { stdio: _, grammar } = arguments;
    if *grammar {
        let text = serde_json::to_string_pretty(&grammar::grammar()).map_err(words)?;
        return writeln!(std::io::stdout(), "{text}").map_err(Failure::Output);
    }
    serve(&mut std::io::stdin().lock(), &mut std::io::stdout().lock())
}

fn words(error: impl std::fmt::Display) -> Failure {
    Failure::Words(error.to_string())
}

fn capabilities() -> ServerCapabilities {
    ServerCapabilities {
        position_encoding: Some(PositionEncodingKind::UTF16),
        text_document_sync: Some(TextDocumentSyncCapability::Kind(TextDocumentSyncKind::FULL)),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        completion_provider: Some(lsp_types::CompletionOptions::default()),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: Default::default(),
        })),
        document_formatting_provider: Some(OneOf::Left(true)),
        ..ServerCapabilities::default()
    }
}

/// The state of a session.
#[derive(Clone, Copy, PartialEq)]
enum Session {
    Begins,
    Runs,
    IsShut,
}

/// Answers messages until the client ends the session. It ends well after `shutdown`, and if it never began.
fn serve(from: &mut impl BufRead, out: &mut impl Write) -> Result<(), Failure> {
    let (mut open, mut session) = (Open::new(), Session::Begins);
    let mut messages = Messages::new(from);
    loop {
        let message = match messages.read()? {
            Incoming::Message(message) => message,
            Incoming::Malformed(id, code, reason) => {
                transport::refuse(out, &id, code, &reason)?;
                continue;
            }
            Incoming::Answer => continue,
            Incoming::End if session == Session::Runs => {
                return Err(words("the client ended without `shutdown`"));
            }
            Incoming::End => return Ok(()),
        };
        match message {
            Message::Request(request) => {
                Message::Response(respond(&open, &mut session, request)?).write(out)?;
            }
            Message::Notification(notification) if notification.method == Exit::METHOD => {
                return if session == Session::IsShut { Ok(()) } else { Err(Failure::Reported) };
            }
            Message::Notification(notification) if session == Session::Runs => {
                if let Some(found) = notice(&mut open, notification) {
                    let method = PublishDiagnostics::METHOD.to_owned();
                    Message::Notification(Notification::new(method, found)).write(out)?;
                }
            }
            Message::Notification(_) | Message::Response(_) => {}
        }
    }
}

/// The response to a request, which may begin or end the session.
fn respond(open: &Open, session: &mut Session, request: Request) -> Result<Response, Failure> {
    let refused =
        |id, code: ErrorCode, reason: &str| Ok(Response::new_err(id, code as i32, reason.to_owned()));
    match (*session, request.method.as_str()) {
        (Session::Begins, Initialize::METHOD) => {
            *session = Session::Runs;
            let capabilities = serde_json::to_value(capabilities()).map_err(words)?;
            let server = serde_json::json!({ "name": "bp", "version": env!("CARGO_PKG_VERSION") });
            let begun = serde_json::json!({ "capabilities": capabilities, "serverInfo": server });
            Ok(Response::new_ok(request.id, begun))
        }
        (Session::Begins, _) => {
            refused(request.id, ErrorCode::ServerNotInitialized, "the first request is `initialize`")
        }
        (Session::IsShut, _) => {
            refused(request.id, ErrorCode::InvalidRequest, "the session is shut down; only `exit` is left")
        }
        (Session::Runs, Initialize::METHOD) => {
            refused(request.id, ErrorCode::InvalidRequest, "the session has begun already")
        }
        (Session::Runs, Shutdown::METHOD) => {
            *session = Session::IsShut;
            Ok(Response::new_ok(request.id, serde_json::Value::Null))
        }
        (Session::Runs, _) => Ok(answer(open, request)),
    }
}

/// Follows a document; returns the diagnostics to be shown.
fn notice(open: &mut Open, notification: Notification) -> Option<PublishDiagnosticsParams> {
    /// A notification has no answer that could say what is wrong with it.
    fn read<P: DeserializeOwned>(Notification { method, params }: Notification) -> Option<P> {
        let read = serde_json::from_value(params);
        read.map_err(|error| warn(&format!("bp lsp: `{method}` cannot be read: {error}"))).ok()
    }
    let shown = |uri: Uri, version, document: &Document| {
        let diagnostics = document.diagnostics(&uri);
        PublishDiagnosticsParams { uri, diagnostics, version }
    };
    match notification.method.as_str() {
        DidOpenTextDocument::METHOD => {
            let opened = read::<lsp_types::DidOpenTextDocumentParams>(notification)?.text_document;
            let document = Document::new(opened.text);
            let found = shown(opened.uri.clone(), Some(opened.version), &document);
            open.insert(opened.uri.as_str().to_owned(), document);
            Some(found)
        }
        DidChangeTextDocument::METHOD => {
            let changed = read::<lsp_types::DidChangeTextDocumentParams>(notification)?;
            // The whole text, as was agreed.
            let text = changed.content_changes.into_iter().next_back()?.text;
            let lsp_types::VersionedTextDocumentIdentifier { uri, version } = changed.text_document;
            let before = open.remove(uri.as_str());
            let document = Document::after(text, before);
            let found = shown(uri.clone(), Some(version), &document);
            open.insert(uri.as_str().to_owned(), document);
            Some(found)
        }
        DidCloseTextDocument::METHOD => {
            let uri = read::<lsp_types::DidCloseTextDocumentParams>(notification)?.text_document.uri;
            open.remove(uri.as_str());
            Some(PublishDiagnosticsParams { uri, diagnostics: Vec::new(), version: None })
        }
        _ => None,
    }
}

/// Answers a request about an open document.
fn answer(open: &Open, request: Request) -> Response {
    let Request { id, method, params } = request;
    let found = match method.as_str() {
        HoverRequest::METHOD => at(open, params, Document::hover),
        Completion::METHOD => at(open, params, |document, offset| Some(document.completions(offset))),
        GotoDefinition::METHOD => at_in(open, params, Document::definition),
        References::METHOD => {
            at_in(open, params, |document, uri, offset| Some(document.references(uri, offset)))
        }
        PrepareRenameRequest::METHOD => at(open, params, Document::renameable),
        Rename::METHOD => renamed(open, params),
        Formatting::METHOD => of(open, params, |document| Some(document.formatted())),
        DocumentSymbolRequest::METHOD => of(open, params, |document| Some(document.outline())),
        other => Err((ErrorCode::MethodNotFound, format!("`{other}` is not supported"))),
    };
    match found {
        Ok(found) => Response::new_ok(id, found),
        Err((code, message)) => Response::new_err(id, code as i32, message),
    }
}

/// A result, or the reason why there is none.
type Found = Result<serde_json::Value, (ErrorCode, String)>;

fn wrong(message: impl std::fmt::Display) -> (ErrorCode, String) {
    (ErrorCode::InvalidParams, message.to_string())
}

fn json(found: impl Serialize) -> Found {
    serde_json::to_value(found).map_err(wrong)
}

fn document<'o>(open: &'o Open, uri: &Uri) -> Result<&'o Document, (ErrorCode, String)> {
    open.get(uri.as_str()).ok_or_else(|| wrong(format!("`{}` is not open", uri.as_str())))
}

/// Of a document: `{ textDocument }`.
fn of<T: Serialize>(
    open: &Open,
    params: serde_json::Value,
    read: impl FnOnce(&Document) -> Option<T>,
) -> Found {
    #[derive(serde::Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Of {
        text_document: lsp_types::TextDocumentIdentifier,
    }
    let Of { text_document } = serde_json::from_value(params).map_err(wrong)?;
    json(read(document(open, &text_document.uri)?))
}

/// At a place of a document: `{ textDocument, position }`.
fn at<T: Serialize>(
    open: &Open,
    params: serde_json::Value,
    read: impl FnOnce(&Document, usize) -> Option<T>,
) -> Found {
    at_in(open, params, |document, _, offset| read(document, offset))
}

fn at_in<T: Serialize>(
    open: &Open,
    params: serde_json::Value,
    read: impl FnOnce(&Document, &Uri, usize) -> Option<T>,
) -> Found {
    let params: TextDocumentPositionParams = serde_json::from_value(params).map_err(wrong)?;
    let uri = params.text_document.uri;
    let document = document(open, &uri)?;
    json(read(document, &uri, document.offset(params.position)))
}

fn renamed(open: &Open, params: serde_json::Value) -> Found {
    let lsp_types::RenameParams { text_document_position: place, new_name, .. } =
        serde_json::from_value(params).map_err(wrong)?;
    let uri = place.text_document.uri;
    let document = document(open, &uri)?;
    let edits = document.rename(document.offset(place.position), &new_name);
    json(edit::of_document(&uri, edits.map_err(|reason| (ErrorCode::RequestFailed, reason))?))
}
