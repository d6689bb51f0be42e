//! Access control: only local pages that know the secret are answered.
//!
//! The secret is in the fragment of the address, which browsers do not send; the page sends it as a header, which pages
//! of other origins cannot do without permission, and none is given. `Host` is checked because a foreign name may
//! resolve to this machine (DNS rebinding), and its page would then be of our origin.

use std::io;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

/// The header with the secret.
const SECRET: HeaderName = HeaderName::from_static("x-dgd-secret");

/// Length of the secret in bytes.
const BYTES: usize = 16;

/// A page may load only the server's own files.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The data against which requests are checked.
pub(super) struct RequestGuard {
    secret: String,
    port: u16,
}

impl RequestGuard {
    /// A guard with a new secret.
    pub(super) fn new(port: u16) -> io::Result<RequestGuard> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
        let secret = format!("{:032x}", u128::from_be_bytes(bytes));
        Ok(RequestGuard { secret, port })
    }

    /// The address of the page, with the secret.
    pub(super) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/#{}", self.port, self.secret)
    }

    /// Whether this is our host and port.
    fn is_own_host(&self, host: &str) -> bool {
        ["127.0.0.1", "localhost"].iter().any(|name| host == format!("{name}:{}", self.port))
    }

    /// Why a request is refused, regardless of its target.
    fn refusal(&self, method: &Method, headers: &HeaderMap) -> Option<(StatusCode, &'static str)> {
        let text = |name| headers.get(name).map(|value: &HeaderValue| value.to_str().unwrap_or(""));
        if method != Method::GET && method != Method::POST {
            return Some((StatusCode::METHOD_NOT_ALLOWED, "only GET and POST are answered"));
        }
        if headers.get_all(header::HOST).iter().count() != 1
            || !text(header::HOST).is_some_and(|host| self.is_own_host(host))
        {
            return Some((StatusCode::FORBIDDEN, "this is not the host that was asked for"));
        }
        let is_own = |origin: &str| {
            origin.strip_prefix("http://").is_some_and(|host| self.is_own_host(host))
        };
        if !text(header::ORIGIN).is_none_or(is_own) {
            return Some((StatusCode::FORBIDDEN, "a page of another origin asks"));
        }
        let site = text(HeaderName::from_static("sec-fetch-site"));
        if !site.is_none_or(|site| ["same-origin", "none"].contains(&site)) {
            return Some((StatusCode::FORBIDDEN, "a page of another site asks"));
        }
        None
    }

    /// Whether these are the secret's bytes, compared in constant time.
    fn is_secret(&self, given: &[u8]) -> bool {
        let secret = self.secret.as_bytes();
        let pairs = secret.iter().zip(given);
        secret.len() == given.len() && pairs.fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
    }
}

/// Refuses requests from elsewhere, and forbids caching and use by other origins.
pub(super) async fn verify(
    State(guard): State<Arc<RequestGuard>>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = match guard.refusal(request.method(), request.headers()) {
        Some(refusal) => refusal.into_response(),
        None => next.run(request).await,
    };
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Refuses requests without the secret.
pub(super) async fn want_secret(
    State(guard): State<Arc<RequestGuard>>,
    request: Request,
    next: Next,
) -> Response {
    let secret = request.headers().get(SECRET);
    if secret.is_some_and(|given| guard.is_secret(given.as_bytes())) {
        next.run(request).await
    } else {
        let why = "the secret is missing: open the address that `dgd watch` says, with all that is behind its #";
        (StatusCode::FORBIDDEN, why).into_response()
    }
}
