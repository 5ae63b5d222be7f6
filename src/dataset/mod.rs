//! Tables on disk: Parquet parts, the manifest beside them, and reading them back.

pub(crate) mod atomic;
mod batch;
mod cell;
mod chunk;
mod claims;
mod dictionary;
mod digest;
mod flags;
mod folder;
mod footer;
#[cfg(feature = "read")]
pub mod frame;
mod guard;
mod hybrid;
mod layout;
mod manifest;
mod numbers;
mod part;
mod seal;
mod session;
mod state;
#[cfg(feature = "read")]
mod survey;

pub use batch::batch;
pub use cell::Cell;
pub(crate) use claims::coded;
#[cfg(feature = "query")]
pub(crate) use claims::{check_footer, check_pages};
pub use digest::{Counts, Digest, FEW, Row as DigestRow};
pub use folder::{DatasetError, Folder};
pub use footer::{Footer, StatusCounts};
#[cfg(feature = "read")]
pub use frame::{FrameError, ReadError, Row};
pub(crate) use guard::guarded;
#[cfg(feature = "cli")]
pub(crate) use guard::is_guarded;
pub use layout::Layout;
pub(crate) use layout::{field, label};
pub use manifest::{Build, Manifest, ManifestTable};
pub use part::encode;
pub use session::{Company, Holder, Session};
pub use state::{Look, OpenPart, State};
#[cfg(feature = "read")]
pub use survey::{Survey, TableSurvey};
