//! Tables on disk: Parquet parts, the manifest beside them, and reading them back.

pub(crate) mod atomic;
mod chunk;
mod dictionary;
mod digest;
mod flags;
mod folder;
mod footer;
mod hybrid;
mod layout;
mod numbers;
mod part;

pub use digest::{Cell, Digest, ReadError, Row};
pub use folder::{DatasetError, Folder, Identity, Manifest, ManifestTable};
pub use footer::Footer;
pub use layout::Layout;
pub(crate) use layout::field;
pub use part::encode;
