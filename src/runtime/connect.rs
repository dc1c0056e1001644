//! Connections to a host by its name: one address that does not answer keeps none of the others waiting, and a name server that does
//! not answer keeps one thread waiting for each name, however often the name is asked for.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use tokio::net::{TcpStream, lookup_host};
use tokio::sync::watch;
use tokio::task::JoinSet;

/// After this time without a connection the next address is tried beside those that have not answered (RFC 8305, section 5).
const NEXT_ADDRESS: Duration = Duration::from_millis(250);
/// Addresses of one name that are tried at most.
const MOST_ADDRESSES: usize = 8;

/// What a name server says of a name, or why it says nothing.
type Resolved = Result<Vec<IpAddr>, String>;

/// Names that are being resolved. A resolution cannot be ended: whoever asks meanwhile waits for the same one.
static UNDER_WAY: Mutex<BTreeMap<String, watch::Receiver<Option<Resolved>>>> =
    Mutex::new(BTreeMap::new());

/// A connection to the first address of `host` that answers.
///
/// # Errors
/// Why none of them does.
pub(super) async fn connect(host: &str, port: u16) -> Result<TcpStream, String> {
    first_of(sockets(resolved(host).await?, port)).await
}

fn sockets(addresses: Vec<IpAddr>, port: u16) -> Vec<SocketAddr> {
    let addresses = addresses.into_iter().take(MOST_ADDRESSES);
    addresses.map(|ip| SocketAddr::new(ip, port)).collect()
}

/// The address of `host` that answers, as it stands before a port, for whoever connects by itself; where there is one only, it is not
/// tried.
///
/// # Errors
/// Why none answers.
pub(super) async fn answering(host: &str, port: u16) -> Result<String, String> {
    let addresses = resolved(host).await?;
    let ip = if let [only] = addresses[..] {
        only
    } else {
        let peer = first_of(sockets(addresses, port)).await?.peer_addr();
        peer.map_err(|error| error.to_string())?.ip()
    };
    Ok(match ip {
        IpAddr::V4(ip) => ip.to_string(),
        IpAddr::V6(ip) => format!("[{ip}]"),
    })
}

async fn first_of(addresses: Vec<SocketAddr>) -> Result<TcpStream, String> {
    let is_one = addresses.len() == 1;
    let mut attempts = JoinSet::new();
    let mut failed = Vec::new();
    let mut left = addresses.into_iter();
    loop {
        if let Some(address) = left.next() {
            attempts.spawn(async move {
                let stream = TcpStream::connect(address).await;
                stream.map_err(|error| (address, error))
            });
        }
        let ended = tokio::select! {
            ended = attempts.join_next() => ended,
            () = tokio::time::sleep(NEXT_ADDRESS), if left.len() > 0 => continue,
        };
        match ended {
            Some(Ok(Ok(stream))) => return Ok(stream),
            Some(Ok(Err((_, error)))) if is_one => return Err(error.to_string()),
            Some(Ok(Err((address, error)))) => failed.push(format!("{address}: {error}")),
            Some(Err(error)) => failed.push(error.to_string()),
            None => return Err(failed.join("; ")),
        }
    }
}

async fn resolved(host: &str) -> Resolved {
    let host = host.trim_start_matches('[').trim_end_matches(']');
    if let Ok(ip) = host.parse() {
        return Ok(vec![ip]);
    }
    let mut answer = under_way(host);
    let resolved = answer.wait_for(Option::is_some).await;
    if let Ok(Some(resolved)) = resolved.map(|resolved| resolved.clone()) {
        return resolved;
    }
    // The runtime that asked has ended.
    forget(host);
    lookup(host).await
}

fn under_way(host: &str) -> watch::Receiver<Option<Resolved>> {
    let mut all = UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner);
    let receiver = all.entry(host.to_owned()).or_insert_with(|| {
        let (sender, receiver) = watch::channel(None);
        let host = host.to_owned();
        tokio::spawn(async move {
            let resolved = lookup(&host).await;
            forget(&host);
            sender.send_replace(Some(resolved));
        });
        receiver
    });
    receiver.clone()
}

fn forget(host: &str) {
    let mut all = UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner);
    all.remove(host);
}

async fn lookup(host: &str) -> Resolved {
    let found = lookup_host((host, 0)).await;
    let found = found.map_err(|error| format!("{host}: {error}"))?;
    let addresses: Vec<IpAddr> = found.map(|address| address.ip()).collect();
    if addresses.is_empty() {
        return Err(format!("{host}: no address"));
    }
    Ok(addresses)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::net::{TcpListener, TcpSocket};

    /// An address that answers to no further connection: its queue is full.
    async fn silent() -> (SocketAddr, Vec<TcpStream>) {
        let socket = TcpSocket::new_v4().unwrap();
        socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let listener = socket.listen(1).unwrap();
        let address = listener.local_addr().unwrap();
        let mut waiting = Vec::new();
        while let Ok(stream) =
            tokio::time::timeout(Duration::from_millis(200), TcpStream::connect(address)).await
        {
            waiting.push(stream.unwrap());
        }
        // It listens as long as the process lives.
        std::mem::forget(listener);
        (address, waiting)
    }

    #[tokio::test]
    async fn an_address_that_does_not_answer_keeps_no_other_waiting() {
        let (silent, _waiting) = silent().await;
        let receiver = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let good = receiver.local_addr().unwrap();
        let connected = tokio::time::timeout(Duration::from_secs(5), first_of(vec![silent, good]));
        let stream = connected.await.unwrap().unwrap();
        assert_eq!(stream.peer_addr().unwrap(), good);
    }

    #[tokio::test]
    async fn addresses_that_refuse_are_named() {
        let free = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = free.local_addr().unwrap();
        drop(free);
        let error = first_of(vec![address, address]).await.unwrap_err();
        assert_eq!(error.matches(&address.to_string()).count(), 2, "{error}");
        assert!(error.contains("refused"), "{error}");
    }

    #[tokio::test]
    async fn a_name_that_many_ask_for_is_resolved_once_at_a_time() {
        let first = under_way("localhost");
        let mut asked = JoinSet::new();
        for _ in 0..50 {
            asked.spawn(resolved("localhost"));
            assert!(under_way("localhost").same_channel(&first));
        }
        while let Some(addresses) = asked.join_next().await {
            assert!(addresses.unwrap().unwrap().iter().all(IpAddr::is_loopback));
        }
        assert!(!under_way("localhost").same_channel(&first), "asked anew");
    }

    #[tokio::test]
    async fn a_host_that_is_an_address_is_not_resolved() {
        assert_eq!(answering("127.0.0.1", 1).await.unwrap(), "127.0.0.1");
        assert_eq!(answering("[::1]", 1).await.unwrap(), "[::1]");
    }
}
