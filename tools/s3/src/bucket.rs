//! Results in a bucket: an atomic conditional request of the store writes a text unless it exists.

use std::path::PathBuf;
use std::sync::Arc;

use dgd_job::{JobError, KeyValueStore};
use futures_util::TryStreamExt;
use object_store::aws::{AmazonS3, AmazonS3Builder};
use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt, PutMode, PutPayload, RetryConfig};
use tokio::runtime::{Builder, Runtime};

/// Number of retries of a request without an answer, at increasing intervals, half a minute in total.
const RETRIES: usize = 8;

/// A folder of a bucket.
#[derive(Debug)]
struct Bucket {
    store: AmazonS3,
    /// Runs requests to their end.
    runtime: Runtime,
    /// `s3://bucket/folder`.
    name: String,
    folder: Path,
}

/// Opens `s3://bucket/folder`. Location and credentials come from the environment, as for other programs:
/// `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, `AWS_ENDPOINT` and so on.
///
/// # Errors
///
/// It is not the name of a bucket, or the environment is invalid.
pub(crate) fn open(name: &str) -> Result<Arc<dyn KeyValueStore>, JobError> {
    let error_of = |reason: String| JobError::Store { path: PathBuf::from(name), reason };
    let rest = name.strip_prefix("s3://").unwrap_or(name).trim_end_matches('/');
    let (bucket, folder) = rest.split_once('/').unwrap_or((rest, ""));
    if bucket.is_empty() {
        return Err(error_of("this names no bucket: write `s3://bucket/folder`".to_owned()));
    }
    let folder = Path::parse(folder).map_err(|error| error_of(error.to_string()))?;
    let retry = RetryConfig { max_retries: RETRIES, ..RetryConfig::default() };
    let store = AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retry).build();
    let store = store.map_err(|error| error_of(words(&error)))?;
    let runtime = Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|error| error_of(error.to_string()))?;
    let name = name.trim_end_matches('/').to_owned();
    Ok(Arc::new(Bucket { store, runtime, name, folder }))
}

/// An error in one line.
fn words(error: &Error) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Bucket {
    fn at(&self, key: &str) -> Path {
        let parts = key.split('/').filter(|part| !part.is_empty());
        parts.fold(self.folder.clone(), |path, part| path.join(part))
    }

    /// Waits for an answer; `None` if the object does not exist.
    fn found<T>(
        &self,
        key: &str,
        answer: impl Future<Output = Result<T, Error>>,
    ) -> Result<Option<T>, JobError> {
        match self.runtime.block_on(answer) {
            Ok(found) => Ok(Some(found)),
            Err(Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(JobError::Store {
                path: PathBuf::from(format!("{}/{key}", self.name)),
                reason: words(&error),
            }),
        }
    }

    fn put_by(&self, key: &str, text: &str, mode: PutMode) -> Result<(), JobError> {
        let (path, text) = (self.at(key), PutPayload::from(text.to_owned()));
        let put = self.store.put_opts(&path, text, mode.into());
        let put = async {
            match put.await {
                // Another process was first.
                Ok(_) | Err(Error::AlreadyExists { .. }) => Ok(()),
                Err(error) => Err(error),
            }
        };
        match self.found(key, put)? {
            Some(()) => Ok(()),
            None => Err(JobError::Store {
                path: PathBuf::from(&self.name),
                reason: "there is no such bucket".to_owned(),
            }),
        }
    }
}

impl KeyValueStore for Bucket {
    fn read(&self, key: &str) -> Result<Option<String>, JobError> {
        let path = self.at(key);
        let bytes = async { self.store.get(&path).await?.bytes().await };
        let bytes = self.found(key, bytes)?;
        Ok(bytes.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
    }

    fn has(&self, key: &str) -> Result<bool, JobError> {
        let path = self.at(key);
        Ok(self.found(key, self.store.head(&path))?.is_some())
    }

    fn put_first(&self, key: &str, text: &str) -> Result<(), JobError> {
        self.put_by(key, text, PutMode::Create)
    }

    fn put(&self, key: &str, text: &str) -> Result<(), JobError> {
        self.put_by(key, text, PutMode::Overwrite)
    }

    fn remove(&self, key: &str) -> Result<(), JobError> {
        let path = self.at(key);
        self.found(key, self.store.delete(&path)).map(|_| ())
    }

    fn keys(&self, begin: &str) -> Result<Vec<String>, JobError> {
        let folder = self.at(begin);
        let paths = self.store.list(Some(&folder)).map_ok(|one| one.location).try_collect();
        let paths: Vec<Path> = self.found(begin, paths)?.unwrap_or_default();
        Ok(paths.iter().map(Path::to_string).collect())
    }

    fn shown(&self, key: &str) -> PathBuf {
        format!("{}/{key}", self.name).into()
    }
}
