//! Clients: a thread reads the lines of each, another writes to it.

use crate::messages::{Fault, Message, Outgoing, parse};
use crate::outbox::Outbox;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

/// Longest line (bytes).
const LONGEST_LINE: u64 = 64 << 10;
/// Clients at a time.
pub const MOST_CLIENTS: usize = 16;
/// Requests that wait at most; then the readers wait.
const MOST_REQUESTS: usize = 256;

/// Number of a client.
pub(crate) type ClientId = usize;

/// What comes from the clients.
pub(crate) enum Heard {
    /// A client has connected.
    Came(ClientId, Arc<Outbox>),
    /// It asks for something.
    Said(ClientId, Message),
    /// It has gone.
    Left(ClientId),
    /// The gripper has something new.
    Woken,
}

/// What comes from all clients.
pub struct Clients {
    pub(crate) heard: Receiver<Heard>,
    /// For those who wake the desk.
    pub(crate) sender: SyncSender<Heard>,
    /// The thread that writes to the only client, with which the desk ends.
    pub(crate) only: Option<JoinHandle<()>>,
}

impl Clients {
    fn new() -> Self {
        let (sender, heard) = sync_channel(MOST_REQUESTS);
        Self { heard, sender, only: None }
    }
}

/// Listens on a port of this computer, 0 for any free one; other computers cannot connect. Returns the address.
pub fn listen(port: u16) -> std::io::Result<(Clients, SocketAddr)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    let (address, clients) = (listener.local_addr()?, Clients::new());
    let (sender, connected) = (clients.sender.clone(), Arc::new(AtomicUsize::new(0)));
    Builder::new().name("serve-listen".to_owned()).spawn(move || {
        for (id, stream) in listener.incoming().enumerate() {
            // One that has gone again is none.
            let Ok(stream) = stream else { continue };
            if let Err(cause) = welcome(id, stream, &sender, &connected) {
                tracing::warn!("a client could not be served: {cause}");
            }
        }
    })?;
    Ok((clients, address))
}

/// Serves one client, on standard input and output.
pub fn listen_to_input() -> std::io::Result<Clients> {
    let mut clients = Clients::new();
    let leaves = Leaves { id: 0, sender: clients.sender.clone(), connected: None };
    let reader = BufReader::new(std::io::stdin());
    clients.only = Some(attend(0, reader, std::io::stdout(), leaves, Arc::new(|| ()))?);
    Ok(clients)
}

fn welcome(
    id: ClientId,
    mut stream: TcpStream,
    sender: &SyncSender<Heard>,
    connected: &Arc<AtomicUsize>,
) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    if connected.fetch_add(1, Ordering::Relaxed) >= MOST_CLIENTS {
        connected.fetch_sub(1, Ordering::Relaxed);
        let text = format!("{MOST_CLIENTS} clients are connected; close one first");
        return stream.write_all(Outgoing::to(Value::Null, Err(text.into())).line().as_bytes());
    }
    let leaves = Leaves { id, sender: sender.clone(), connected: Some(Arc::clone(connected)) };
    let (reader, cut) = (BufReader::new(stream.try_clone()?), stream.try_clone()?);
    let cut = move || {
        // One that has gone is cut already.
        let _cut = cut.shutdown(Shutdown::Both);
    };
    attend(id, reader, stream, leaves, Arc::new(cut)).map(drop)
}

/// Says that a client has gone, whatever ended its reader.
struct Leaves {
    id: ClientId,
    sender: SyncSender<Heard>,
    connected: Option<Arc<AtomicUsize>>,
}

impl Drop for Leaves {
    fn drop(&mut self) {
        if let Some(connected) = &self.connected {
            connected.fetch_sub(1, Ordering::Relaxed);
        }
        // The desk may have ended.
        let _heard = self.sender.send(Heard::Left(self.id));
    }
}

/// Starts the threads of a client; `cut` closes the connection. Returns the one that writes.
fn attend(
    id: ClientId,
    reader: impl BufRead + Send + 'static,
    mut writer: impl Write + Send + 'static,
    leaves: Leaves,
    cut: Arc<dyn Fn() + Send + Sync>,
) -> std::io::Result<JoinHandle<()>> {
    let outbox = Arc::<Outbox>::default();
    // First of all, so that the client is known before it asks.
    let _heard = leaves.sender.send(Heard::Came(id, Arc::clone(&outbox)));
    let written = Arc::clone(&outbox);
    let (gone, ends) = (leaves.sender.clone(), Arc::clone(&cut));
    let writing = Builder::new().name("serve-write".to_owned()).spawn(move || {
        while let Some(bytes) = written.take() {
            if writer.write_all(&bytes).and_then(|()| writer.flush()).is_err() {
                break;
            }
        }
        written.close();
        ends();
        // Standard input may stay open behind a closed output.
        let _heard = gone.send(Heard::Left(id));
    })?;
    Builder::new().name("serve-read".to_owned()).spawn(move || {
        read_lines(reader, &outbox, &leaves);
        if outbox.is_cut() {
            cut();
        }
    })?;
    Ok(writing)
}

/// Reads to the end; answers what is no request.
fn read_lines(mut reader: impl BufRead, outbox: &Outbox, client: &Leaves) {
    let mut line = Vec::new();
    loop {
        line.clear();
        match reader.by_ref().take(LONGEST_LINE + 1).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        let read = if line.len() as u64 > LONGEST_LINE {
            if skip_line(&mut reader, &line).is_err() {
                return;
            }
            Err((Value::Null, Fault::from(format!("the line is longer than {LONGEST_LINE} bytes"))))
        } else if line.trim_ascii().is_empty() {
            continue;
        } else {
            parse(&line)
        };
        match read {
            Ok(message) => {
                if client.sender.send(Heard::Said(client.id, message)).is_err() {
                    return;
                }
            }
            Err((id, fault)) => outbox.answer(&Outgoing::to(id, Err(fault))),
        }
        if outbox.is_cut() {
            return;
        }
    }
}

/// Skips the rest of a line.
fn skip_line(reader: &mut impl BufRead, begun: &[u8]) -> std::io::Result<()> {
    if begun.ends_with(b"\n") { Ok(()) } else { reader.skip_until(b'\n').map(drop) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::from_slice;
    use std::sync::mpsc::{Sender, channel};

    /// A connection that takes a line of writing each time it is told to.
    struct Gate {
        told: Receiver<()>,
        written: Sender<Vec<u8>>,
    }

    impl Write for Gate {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.told.recv().map_err(std::io::Error::other)?;
            self.written.send(bytes.to_vec()).map_err(std::io::Error::other)?;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_client_that_does_not_read_holds_up_nobody_and_is_told_what_it_lost() {
        let clients = Clients::new();
        let ((tell, told), (written, lines)) = (channel(), channel());
        let leaves = Leaves { id: 0, sender: clients.sender.clone(), connected: None };
        let gate = Gate { told, written };
        let writing = attend(0, std::io::empty(), gate, leaves, Arc::new(|| ())).expect("threads");
        let Ok(Heard::Came(0, outbox)) = clients.heard.recv() else { panic!("it has come") };
        const MANY: u64 = 100_000;
        (0..MANY).for_each(|k| outbox.sample(&Arc::from(format!("{k}\n"))));
        outbox.close();
        // More often than there is something to write.
        (0..MANY).for_each(|_| _ = tell.send(()));
        writing.join().expect("no panic");
        let bytes: Vec<u8> = lines.try_iter().flatten().collect();
        let (mut rows, mut lost, mut last) = (0, 0, None);
        for line in bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
            match from_slice::<Value>(line).expect("JSON") {
                Value::Number(k) => (rows, last) = (rows + 1, k.as_u64()),
                event => lost += event["samples"].as_u64().expect("what is lost"),
            }
        }
        assert_eq!((rows + lost, last), (MANY, Some(MANY - 1)), "the newest are kept, the others counted");
        assert!(lost > MANY / 2, "{lost} lost");
    }
}
