//! Tables on disk: Parquet parts, the manifest beside them, and reading them back.

pub(crate) mod atomic;
mod batch;
mod chunk;
mod claims;
mod dictionary;
#[cfg(feature = "read")]
mod digest;
mod flags;
mod folder;
mod footer;
#[cfg(feature = "read")]
pub mod frame;
mod guard;
mod hybrid;
mod layout;
mod numbers;
mod part;
mod seal;
mod state;
#[cfg(feature = "read")]
mod survey;

pub use batch::batch;
pub(crate) use claims::{check_footer, check_pages};
#[cfg(feature = "read")]
pub use digest::{Digest, ReadError};
pub use folder::{DatasetError, Folder, Identity, Manifest, ManifestTable};
pub use footer::{Footer, StatusCounts};
#[cfg(feature = "read")]
pub use frame::{Cell, FrameError, Row};
pub(crate) use guard::guarded;
#[cfg(feature = "cli")]
pub(crate) use guard::is_guarded;
pub use layout::Layout;
pub(crate) use layout::field;
pub use part::encode;
pub use state::{Look, State};
#[cfg(feature = "read")]
pub use survey::{Survey, TableSurvey};
