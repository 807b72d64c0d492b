use bytes::Bytes;
use tokio::{
    io::copy_bidirectional,
    net::{TcpListener, TcpStream},
    task::{JoinSet, spawn_blocking},
};

use super::*;
use crate::{
    jobs::{Lane, Submission, store::tests::nats_config},
    segment::Stage,
};

/// A server and two processes that share it.
async fn two() -> (NatsServer, [Arc<Nats>; 2]) {
    let server = NatsServer::start();
    let config = nats_config(&server);
    let first = Nats::connect(config.clone()).await.unwrap();
    let second = Nats::connect(config).await.unwrap();
    (server, [first, second])
}

/// A job that is kept and in the queue.
async fn queued(nats: &Arc<Nats>) -> JobRecord {
    let record = JobRecord::new(Submission::default(), 3);
    let (own, new) = (Arc::clone(nats), record.clone());
    let kept = spawn_blocking(move || own.insert(&new, Bytes::from_static(b"abc")));
    kept.await.unwrap().unwrap();
    nats.queue().put(Lane::Small, record.id, 1).await.unwrap();
    record
}

async fn next(nats: &Arc<Nats>) -> Delivery {
    let consumer = nats.queue().consumer("small").await.unwrap();
    for _ in 0..20 {
        if let Some(delivery) = nats.queue().next(&consumer).await.unwrap() {
            return delivery;
        }
    }
    panic!("nothing is handed out");
}

async fn begin(nats: &Arc<Nats>, record: &JobRecord) -> Result<(), StoreError> {
    let (nats, record) = (Arc::clone(nats), record.clone());
    spawn_blocking(move || nats.begin(&record)).await.unwrap()
}

async fn finish(nats: &Arc<Nats>, record: &JobRecord, result: &str) -> Result<(), StoreError> {
    let (nats, mut record) = (Arc::clone(nats), record.clone());
    (record.state, record.finished_ms) = (JobState::Succeeded, Some(now_ms()));
    let result = Bytes::from(result.to_owned());
    record.result_bytes = result.len() as u64;
    spawn_blocking(move || nats.finish(&record, Some(result))).await.unwrap()
}

async fn result(nats: &Arc<Nats>, id: Uuid) -> Option<Bytes> {
    let nats = Arc::clone(nats);
    spawn_blocking(move || nats.result(id)).await.unwrap().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_ends_the_first_stays_and_the_other_is_told() {
    let (_server, [a, b]) = two().await;
    let record = queued(&a).await;
    begin(&a, &record).await.unwrap();
    begin(&b, &record).await.unwrap();
    finish(&a, &record, "first").await.unwrap();
    let Err(StoreError::Ended(Some(told))) = finish(&b, &record, "second").await else {
        panic!("the second end is taken")
    };
    assert_eq!((told.state, told.result_bytes), (JobState::Succeeded, 5));
    assert!(matches!(begin(&b, &record).await, Err(StoreError::Ended(Some(_)))));
    assert_eq!(result(&b, record.id).await.unwrap(), "first");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_whose_worker_lives_is_left_to_it_and_one_whose_worker_ended_is_counted() {
    let (_server, [a, b]) = two().await;
    let record = queued(&a).await;
    assert_eq!(next(&a).await.job(), Some(record.id));
    assert_eq!(a.claim(record.id).await.unwrap(), Claim::Run(Box::new(record.clone())));
    let at_work = a.at_work(record.id).unwrap();
    assert!(a.at_work(record.id).is_none());
    begin(&a, &record).await.unwrap();
    // nobody says that it goes on, so it is handed out again
    let again = next(&b).await;
    assert!(again.times > 1);
    assert_eq!(b.claim(record.id).await.unwrap(), Claim::Elsewhere);
    drop(at_work);
    let Claim::Run(counted) = b.claim(record.id).await.unwrap() else { panic!("not run again") };
    assert_eq!((counted.crashes, counted.state), (1, JobState::Queued));
    finish(&b, &counted, "done").await.unwrap();
    assert_eq!(b.claim(record.id).await.unwrap(), Claim::Over);
    again.done().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_given_back_has_not_crashed() {
    let (_server, [a, b]) = two().await;
    let record = queued(&a).await;
    let delivery = next(&a).await;
    let at_work = a.at_work(record.id).unwrap();
    begin(&a, &record).await.unwrap();
    a.give_back(record.id).await.unwrap();
    drop(at_work);
    delivery.later(Duration::ZERO).await;
    assert_eq!(next(&b).await.job(), Some(record.id));
    let Claim::Run(record) = b.claim(record.id).await.unwrap() else { panic!("not run again") };
    assert_eq!((record.crashes, record.state), (0, JobState::Queued));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_is_worked_on_is_not_handed_out_again() {
    let (_server, [a, b]) = two().await;
    queued(&a).await;
    let delivery = next(&a).await;
    let kept = delivery.keep();
    let consumer = b.queue().consumer("small").await.unwrap();
    // three times as long as a silent worker has
    for _ in 0..3 {
        assert!(b.queue().next(&consumer).await.unwrap().is_none());
    }
    drop(kept);
    assert!(next(&b).await.times > 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_ended_job_leaves_the_queue_and_a_second_attempt_is_no_duplicate_of_the_first() {
    let (_server, [a, _]) = two().await;
    let record = queued(&a).await;
    assert!(a.queue().has(Lane::Small, record.id).await.unwrap());
    next(&a).await.done().await;
    while a.queue().has(Lane::Small, record.id).await.unwrap() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    a.queue().put(Lane::Small, record.id, 2).await.unwrap();
    assert_eq!(next(&a).await.job(), Some(record.id));
}

#[tokio::test(flavor = "multi_thread")]
async fn every_process_is_told_of_every_change_in_one_order() {
    let (_server, [a, b]) = two().await;
    let before = queued(&a).await;
    let mut told = [a.follow(), b.follow()];
    for changes in &mut told {
        assert_eq!(changes.recv().await, Some(Change::Kept(before.clone())));
        assert_eq!(changes.recv().await, Some(Change::All([before.id].into())));
    }
    let record = queued(&b).await;
    begin(&a, &record).await.unwrap();
    let (forgotten, id) = (Arc::clone(&b), before.id);
    spawn_blocking(move || forgotten.remove(id)).await.unwrap().unwrap();
    for changes in &mut told {
        assert_eq!(changes.recv().await, Some(Change::Kept(record.clone())));
        let Some(Change::Kept(begun)) = changes.recv().await else { panic!("no change") };
        assert_eq!((begun.id, begun.state), (record.id, JobState::Running));
        assert_eq!(changes.recv().await, Some(Change::Gone(before.id)));
    }
    let progress = Progress { stage: Stage::Grow, fraction: 0.25 };
    a.tell_progress(record.id, progress).await;
    assert_eq!(told[1].recv().await, Some(Change::Progress(record.id, progress)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_that_differs_stops_the_start_and_a_limit_is_changed() {
    let server = NatsServer::start();
    let config = nats_config(&server);
    drop(Nats::connect(config.clone()).await.unwrap());
    let more =
        NatsConfig { bytes: 128 << 20, max_age: Duration::from_secs(7200), ..config.clone() };
    drop(Nats::connect(more).await.unwrap());
    let other = NatsConfig { storage: NatsStorage::Memory, ..config.clone() };
    let error = Nats::connect(other).await.unwrap_err();
    assert!(matches!(error, NatsError::Differs { field: "storage", .. }), "{error}");
    // one server cannot keep three copies
    let other = NatsConfig { replicas: 3, prefix: "three".to_owned(), ..config };
    let error = tokio::time::timeout(Duration::from_secs(60), Nats::connect(other)).await;
    assert!(matches!(error.unwrap().unwrap_err(), NatsError::Stream { .. }));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_server_says_so_and_takes_again_when_there_is_room() {
    let server = NatsServer::start();
    let config = NatsConfig { bytes: 4 << 20, ..nats_config(&server) };
    let nats = Nats::connect(config).await.unwrap();
    let insert = async |length: usize| {
        let (own, record) = (Arc::clone(&nats), JobRecord::new(Submission::default(), 0));
        let id = record.id;
        let input = vec![id.as_bytes()[15]; length].into();
        spawn_blocking(move || own.insert(&record, input)).await.unwrap().map(|()| id)
    };
    let first = insert(3_000_000).await.unwrap();
    let error = insert(3_000_000).await.unwrap_err();
    assert!(matches!(error, StoreError::Full(_)), "{error}");
    let forgotten = Arc::clone(&nats);
    spawn_blocking(move || forgotten.remove(first)).await.unwrap().unwrap();
    insert(3_000_000).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_server_calls_say_so_at_once_and_work_again_when_it_is_back() {
    let mut server = NatsServer::start();
    let nats = Nats::connect(nats_config(&server)).await.unwrap();
    let record = queued(&nats).await;
    server.end();
    while nats.check().is_ok() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    assert!(matches!(begin(&nats, &record).await, Err(StoreError::Away(_))));
    server.run();
    while nats.check().is_err() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    begin(&nats, &record).await.unwrap();
    let found = Arc::clone(&nats);
    let input = spawn_blocking(move || found.input(record.id)).await.unwrap().unwrap();
    assert_eq!(input.unwrap(), "abc");
}

/// A line to `server` at `port`, any where it is 0, until it is dropped.
async fn line(server: &NatsServer, port: u16) -> (u16, JoinSet<()>) {
    let listener = TcpListener::bind(("127.0.0.1", port)).await.unwrap();
    let port = listener.local_addr().unwrap().port();
    let address = server.address("127.0.0.1");
    let mut line = JoinSet::new();
    line.spawn(async move {
        let mut calls = JoinSet::new();
        while let Ok((mut call, _)) = listener.accept().await {
            let mut there = TcpStream::connect(&address).await.unwrap();
            // it ends as either side does
            calls.spawn(async move { drop(copy_bidirectional(&mut call, &mut there).await) });
        }
    });
    (port, line)
}

/// Keeps a record, and forgets it.
async fn keep_and_forget(nats: &Nats) -> JobRecord {
    let record = JobRecord::new(Submission::default(), 0);
    let input = blobs::Blob::of(record.id, "cloud", b"");
    let kept = Kept { record: record.clone(), input, result: None, worker: None };
    nats.records.create(&kept).await.unwrap();
    nats.forget(record.id).await.unwrap();
    record
}

async fn told(changes: &mut mpsc::Receiver<Change>) -> Change {
    let change = tokio::time::timeout(Duration::from_secs(10), changes.recv()).await;
    change.expect("who follows stands still").unwrap()
}

/// Waits until the bucket has so many messages, marks and all.
async fn until_messages(nats: &Nats, count: u64) {
    let stream = &nats.records.bucket().stream;
    for _ in 0..400 {
        if stream.get_info().await.unwrap().state.messages == count {
            return;
        }
        tokio::time::sleep(Duration::from_millis(25)).await;
    }
    panic!("there are not {count} messages");
}

#[tokio::test(flavor = "multi_thread")]
async fn marks_of_forgotten_jobs_are_taken_away_and_nobody_who_follows_stands_still() {
    let (_server, [a, b]) = two().await;
    let mut told_all = [a.follow(), b.follow()];
    for changes in &mut told_all {
        assert_eq!(told(changes).await, Change::All(HashSet::new()));
    }
    // some three hundred marks wait at a time, and are taken away meanwhile
    for _ in 0..2000 {
        let record = keep_and_forget(&a).await;
        for changes in &mut told_all {
            // one that is gone by the time that it is told of is not told of before
            while told(changes).await != Change::Gone(record.id) {}
        }
    }
    until_messages(&a, 0).await;
    // one that is kept stays
    let record = queued(&b).await;
    assert_eq!(told(&mut told_all[0]).await, Change::Kept(record.clone()));
    until_messages(&a, 1).await;
    assert!(a.knows(record.id).await.unwrap());
}

#[tokio::test(flavor = "multi_thread")]
async fn who_was_away_longer_than_a_mark_is_told_that_a_job_is_gone() {
    let server = NatsServer::start();
    let (port, near) = line(&server, 0).await;
    let a = Nats::connect(nats_config(&server)).await.unwrap();
    let servers = vec![format!("nats://127.0.0.1:{port}").parse().unwrap()];
    let b = Nats::connect(NatsConfig { servers, ..nats_config(&server) }).await.unwrap();
    let record = queued(&a).await;
    let (mut own, mut away) = (a.follow(), b.follow());
    for changes in [&mut own, &mut away] {
        assert_eq!(told(changes).await, Change::Kept(record.clone()));
        assert_eq!(told(changes).await, Change::All([record.id].into()));
    }
    drop(near);
    while b.is_connected() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    a.forget(record.id).await.unwrap();
    until_messages(&a, 0).await;
    let _near = line(&server, port).await;
    assert_eq!(told(&mut away).await, Change::All(HashSet::new()));
}

#[tokio::test(flavor = "multi_thread")]
async fn marks_of_a_process_that_ended_are_taken_away_by_the_next() {
    let server = NatsServer::start();
    let a = Nats::connect(nats_config(&server)).await.unwrap();
    // it does not follow, and so does not see its own mark
    keep_and_forget(&a).await;
    drop(a);
    let b = Nats::connect(nats_config(&server)).await.unwrap();
    until_messages(&b, 1).await;
    let _changes = b.follow();
    until_messages(&b, 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_is_taken_up_is_not_withdrawn_by_what_comes_late() {
    let (_server, [a, b]) = two().await;
    let record = queued(&a).await;
    let (_, before) = a.records.get(record.id).await.unwrap().unwrap();
    assert!(b.take_up(record.id).await.unwrap());
    assert!(!a.records.delete(record.id, before).await.unwrap());
    assert!(a.knows(record.id).await.unwrap());
    // one of which nothing has changed is
    a.withdraw(record.id).await.unwrap();
    assert!(!b.knows(record.id).await.unwrap());
    assert!(!b.take_up(record.id).await.unwrap());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_whose_cloud_is_taken_back_is_not_taken_up() {
    let (_server, [a, b]) = two().await;
    let record = queued(&a).await;
    a.blobs.delete_all(record.id).await.unwrap();
    assert!(!b.take_up(record.id).await.unwrap());
    assert!(!a.knows(record.id).await.unwrap());
}
