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

use crate::failure::Failure;
use document::Document;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, Response};
use lsp_types::notification::{
    DidChangeTextDocument, DidCloseTextDocument, DidOpenTextDocument, Notification as _, PublishDiagnostics,
};
use lsp_types::request::{
    Completion, DocumentSymbolRequest, Formatting, GotoDefinition, HoverRequest, PrepareRenameRequest,
    References, Rename, Request as _,
};
use lsp_types::{
    HoverProviderCapability, OneOf, PositionEncodingKind, PublishDiagnosticsParams, RenameOptions,
    ServerCapabilities, TextDocumentPositionParams, TextDocumentSyncCapability, TextDocumentSyncKind, Uri,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::io::Write;

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
    let (connection, threads) = Connection::stdio();
    let capabilities = serde_json::to_value(capabilities()).map_err(words)?;
    // A client that ends before it has begun is no failure.
    if connection.initialize(capabilities).is_ok() {
        serve(&connection)?;
    }
    drop(connection);
    threads
        .join()
        .map_err(|error| words(format!("a message could not be read, or an answer not written: {error}")))
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

/// Answers messages until the client ends the session.
fn serve(connection: &Connection) -> Result<(), Failure> {
    let mut open = Open::new();
    for message in &connection.receiver {
        match message {
            Message::Request(request) => {
                if connection.handle_shutdown(&request).map_err(words)? {
                    return Ok(());
                }
                let response = answer(&open, request);
                connection.sender.send(Message::Response(response)).map_err(words)?;
            }
            Message::Notification(notification) => {
                if let Some(found) = notice(&mut open, notification) {
                    let method = PublishDiagnostics::METHOD.to_owned();
                    let published = Notification::new(method, found);
                    connection.sender.send(Message::Notification(published)).map_err(words)?;
                }
            }
            Message::Response(_) => {}
        }
    }
    Ok(())
}

/// Follows a document; returns the diagnostics to be shown.
fn notice(open: &mut Open, notification: Notification) -> Option<PublishDiagnosticsParams> {
    fn read<P: DeserializeOwned>(notification: Notification) -> Option<P> {
        serde_json::from_value(notification.params).ok()
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
