//! The server of `dgd watch`: local only, and protected by a secret.
//!
//! | | |
//! |---|---|
//! | `GET /` and the files of [`assets`](crate::assets) | the page, without any of the model's contents |
//! | `GET /first` | the page's initial data |
//! | `POST /ask` | an [`PageRequest`], answered by the [`ModelBench`](crate::ModelBench) |
//! | `POST /write` | values into the text of the model: [`write`] |
//! | `GET /events` | server-sent events: a file has changed |
//!
//! Connections and listening pages are limited ([`limits`]). All requests except for the files need the secret
//! ([`guard`]). A separate thread makes runs one after another; a run is abandoned if its page has gone away or sent a
//! new request, or if its files changed.

mod guard;
mod limits;
mod poll;
mod response;
mod state;
mod write;

use std::convert::Infallible;
use std::io;
use std::net::Ipv4Addr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Path as UrlPath, State};
use axum::http::{StatusCode, header};
use axum::middleware;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use dgd_work::RunRequest;
use futures_util::stream::{self, Stream};
use serde_json::json;
use tokio::net::TcpListener;

use crate::ask::PageRequest;
use guard::RequestGuard;
use limits::LimitedListener;
use response::json_response;
use state::ServerState;

/// Serves a model until the process ends. Passes the address with the secret to `tell` once pages can be fetched.
///
/// # Errors
///
/// If the port is taken, or the system provides no port or no secret.
pub fn serve(request: RunRequest, port: u16, tell: impl FnOnce(&str)) -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await?;
        let guard = Arc::new(RequestGuard::new(listener.local_addr()?.port())?);
        let address = guard.address();
        let shared = Arc::new(ServerState::new(request));
        poll::begin(&shared);
        tell(&address);
        axum::serve(LimitedListener::new(listener), router(shared, &guard)).await
    })
}

fn router(shared: Arc<ServerState>, guard: &Arc<RequestGuard>) -> Router {
    let secret = Router::new()
        .route("/first", get(first))
        .route("/events", get(events))
        .route("/ask", post(ask))
        .route("/write", post(write::write))
        .route_layer(middleware::from_fn_with_state(Arc::clone(guard), guard::want_secret));
    Router::new()
        .route("/", get(page))
        .route("/{name}", get(file))
        .merge(secret)
        .layer(middleware::from_fn_with_state(Arc::clone(guard), guard::verify))
        .with_state(shared)
}

async fn page(State(shared): State<Arc<ServerState>>) -> Response {
    asset(&shared, "index.html")
}

async fn file(State(shared): State<Arc<ServerState>>, UrlPath(name): UrlPath<String>) -> Response {
    asset(&shared, &name)
}

fn asset(shared: &ServerState, name: &str) -> Response {
    let Some((name, text)) = shared.assets.iter().find(|(own, _)| *own == name) else {
        return StatusCode::NOT_FOUND.into_response();
    };
    let kind = match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        _ => "text/javascript; charset=utf-8",
    };
    ([(header::CONTENT_TYPE, kind)], text.clone()).into_response()
}

async fn first(State(shared): State<Arc<ServerState>>) -> Response {
    json_response(StatusCode::OK, shared.bench().first().to_string())
}

/// Represents the wait for an answer; dropped when the page goes away or sends a new request.
struct AnswerWait {
    shared: Arc<ServerState>,
    number: u64,
    is_gone: Arc<AtomicBool>,
}

impl Drop for AnswerWait {
    fn drop(&mut self) {
        self.is_gone.store(true, Ordering::SeqCst);
        self.shared.give_up(|number| number == self.number);
    }
}

async fn ask(State(shared): State<Arc<ServerState>>, body: Bytes) -> Response {
    let ask = match PageRequest::read(&body) {
        Ok(ask) => ask,
        Err(why) => {
            let answer = json!({ "ok": false, "error": format!("this cannot be asked: {why}") });
            return json_response(StatusCode::BAD_REQUEST, answer.to_string());
        }
    };
    let number = shared.count.fetch_add(1, Ordering::SeqCst);
    let is_gone = Arc::new(AtomicBool::new(false));
    let _waits = AnswerWait { shared: Arc::clone(&shared), number, is_gone: Arc::clone(&is_gone) };
    let answered = tokio::task::spawn_blocking(move || shared.answer(number, &ask, &is_gone));
    match answered.await {
        Ok(answer) => json_response(StatusCode::OK, answer),
        Err(panic) => {
            let answer =
                json!({ "ok": false, "error": format!("dgd itself has a mistake: {panic}") });
            json_response(StatusCode::INTERNAL_SERVER_ERROR, answer.to_string())
        }
    }
}

async fn events(
    State(shared): State<Arc<ServerState>>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, (StatusCode, &'static str)> {
    let Ok(place) = Arc::clone(&shared.listening).try_acquire_owned() else {
        let why = "too many pages of this model are open: close one and reload this one";
        return Err((StatusCode::SERVICE_UNAVAILABLE, why));
    };
    let changes = shared.changes.subscribe();
    // The permit is returned when the stream ends.
    let events = stream::unfold((changes, place), async |(mut changes, place)| {
        changes.changed().await.ok()?;
        let count = *changes.borrow_and_update();
        let event = Event::default().event("saved").data(count.to_string());
        Some((Ok(event), (changes, place)))
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::default()))
}

#[cfg(test)]
mod tests;
