//! Tables on disk: Parquet parts, the manifest, and their readers.

pub(crate) mod atomic;
mod batch;
mod cell;
mod checksum;
mod chunk;
mod dictionary;
mod folder;
mod footer;
#[cfg(feature = "read")]
pub mod frame;
mod guard;
mod layout;
mod manifest;
mod numbers;
mod part;
mod rle;
mod session;
mod state;
mod statistics;
#[cfg(feature = "read")]
mod survey;

pub use batch::batch;
pub use cell::Cell;
#[cfg(feature = "read")]
pub(crate) use cell::first_row;
pub use folder::{DatasetError, Folder, MANIFEST};
pub use footer::{Footer, StatusCounts};
#[cfg(feature = "read")]
pub use frame::{FrameError, Row};
#[cfg(feature = "cli")]
pub(crate) use guard::is_guarded;
#[cfg(feature = "query")]
pub(crate) use guard::sound;
pub(crate) use guard::{coded, guarded};
pub use layout::Layout;
pub(crate) use layout::{field, label};
pub use manifest::{Build, Manifest, ManifestTable};
pub use part::encode;
pub use session::{Concurrency, Session};
pub use state::{CheckDepth, Foreign, State};
pub use statistics::{Counts, MAX_KEPT_ROWS, Row as StatisticsRow, TableStatistics};
#[cfg(feature = "read")]
pub use survey::{Survey, TableSurvey};
