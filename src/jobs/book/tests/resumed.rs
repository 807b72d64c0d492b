use super::*;

/// A store that holds jobs with these inputs and crashes, in this order.
fn left_by_another(jobs: &[(&'static [u8], u32)]) -> (Arc<Moody>, Vec<Uuid>) {
    let bench = bench();
    let mut ids = Vec::new();
    for (input, crashes) in jobs {
        let record = JobRecord::new(Submission::default(), input.len() as u64);
        ids.push(record.id);
        let record = JobRecord { crashes: *crashes, ..record };
        bench.store.kept.insert(&record, Bytes::from_static(input)).unwrap();
    }
    (bench.store, ids)
}

#[tokio::test]
async fn a_job_that_ended_too_many_processes_is_failed_and_not_run() {
    let (store, ids) = left_by_another(&[(b"abc", CONFIG.max_crashes), (b"abc", 0)]);
    let book = book(&store);
    let jobs = [0, 1].map(|i| book.find(ids[i], None).unwrap());
    let record = last(&jobs[0]).await;
    assert_eq!((record.state, record.started_ms), (JobState::Failed, None));
    assert!(record.fault.unwrap().detail.contains("3 times"));
    assert_eq!(store.kept.records().unwrap()[0].state, JobState::Failed);
    assert_eq!(last(&jobs[1]).await.state, JobState::Succeeded);
    assert_eq!(store.begun(), [ids[1]]);
}

#[tokio::test]
async fn jobs_that_ran_when_a_process_ended_run_after_the_others_the_worst_last() {
    let left = [(&b"abc"[..], 2), (b"abc", 1), (b"abc", 0), (b"abc", 2), (b"abc", 0)];
    let (store, ids) = left_by_another(&left);
    let book = book(&store);
    for id in &ids {
        assert_eq!(last(&book.find(*id, None).unwrap()).await.state, JobState::Succeeded);
    }
    assert_eq!(store.begun(), [2, 4, 1, 0, 3].map(|i| ids[i]));
}

#[tokio::test]
async fn a_job_that_ran_when_a_process_ended_runs_alone() {
    let (store, ids) = left_by_another(&[(b"wait", 1)]);
    let bench = Bench { book: book(&store), store, budget: ByteBudget::new(1000, KeyShare::ALL) };
    let suspect = bench.book.find(ids[0], None).unwrap();
    until(|| suspect.record().state == JobState::Running).await;
    // the other lane is free, but this one waits
    let many = Submission { points: 1000, ..Submission::default() };
    let held = bench.budget.share();
    let (other, _) = bench.book.submit(many, Bytes::from_static(b"abc"), held).await.unwrap();
    tokio::time::sleep(Duration::from_millis(20)).await;
    assert_eq!(other.record().state, JobState::Queued);
    bench.book.cancel(suspect).await.unwrap();
    assert_eq!(last(&other).await.state, JobState::Succeeded);
    assert_eq!(bench.store.begun(), [ids[0], other.record().id]);
    bench.rest().await;
    assert_eq!(bench.store.left(), bench.store.begun());
}

#[tokio::test]
async fn a_cancelled_job_that_waits_for_the_others_lets_the_next_one_run() {
    let (store, ids) = left_by_another(&[(b"wait", 0), (b"wait", 1), (b"abc", 1)]);
    let book = book(&store);
    let jobs = [0, 1, 2].map(|i| book.find(ids[i], None).unwrap());
    until(|| jobs[0].record().state == JobState::Running).await;
    book.cancel(Arc::clone(&jobs[1])).await.unwrap();
    assert_eq!(last(&jobs[1]).await.state, JobState::Cancelled);
    assert_eq!(jobs[2].record().state, JobState::Queued);
    book.cancel(Arc::clone(&jobs[0])).await.unwrap();
    assert_eq!(last(&jobs[2]).await.state, JobState::Succeeded);
}

#[tokio::test]
async fn a_run_that_cannot_be_noted_waits_for_room() {
    let bench = bench();
    bench.store.begin.set(Does::Fails(full()));
    let (job, _) = bench.submit(b"abc").await.unwrap();
    bench.store.begin.called_times(20).await;
    assert_eq!(job.record().state, JobState::Queued);
    bench.store.begin.set(Does::Works);
    assert_eq!(last(&job).await.state, JobState::Succeeded);
    bench.rest().await;
}
