//! Control of the gripper from other programs: JSON lines over TCP on this computer, or over standard input and output. The
//! messages are in `palpate help control`.
//!
//! ```text
//!  client --lines--> reader thread --requests--> "serve"  --commands--> GripperWorker
//!         <--lines-- writer thread <--outbox----  desk    <--views, rows, notices--
//! ```
//!
//! - Air belongs to the client that moved it last: when that client goes, or on Ctrl+C, the fingers vent.
//! - Nothing that a client does holds up another: a reader answers bad lines itself, and samples that a client does not read
//!   are dropped from its own outbox.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | `messages` | requests, answers and events; their schema |
//! | 1 | `emulated` | the emulated gripper in place of a port |
//! | 1 | `outbox` | what is to be written to a client |
//! | 2 | `clients` | threads that read and write lines |
//! | 3 | `desk` | takes requests to the gripper, and what it says to the clients |

mod clients;
mod desk;
mod emulated;
mod messages;
mod outbox;

pub use clients::{Clients, MOST_CLIENTS, listen, listen_to_input};
pub use desk::{Desk, DeskSetup};
pub use emulated::{EmulatedHand, EmulationError};
pub use messages::{
    Advice, Answer, Event, Fault, FlagMessage, GripperPose, Message, Outgoing, Request, Subscription, TrialState,
    VerdictMessage, schema,
};
