use std::{collections::HashMap, fs, time::Duration};

use reqwest::Client;

use super::{
    block_on,
    cloud::bracket,
    jobs::{Tally, result, settled, submit},
    missed,
    random::Random,
    server::Server,
};

const FILES: usize = 120;
const JOBS: usize = 20;
const POINTS: usize = 900;
const WAIT: Duration = Duration::from_secs(10);
/// The first bytes of the file, where the database describes itself.
const HEAD: usize = 512;
/// How a result begins that lies in the file as it was written.
const RESULT: &[u8] = b"{\"conicoid\":";
/// Bytes of a result in which a digit is looked for, and how many there are at least.
const WITHIN: usize = 4096;
const FEW: usize = 100;

pub fn run() -> Vec<String> {
    let directory = tempfile::tempdir().unwrap();
    let data = format!("--data-dir={}", directory.path().display());
    let file = directory.path().join("jobs.redb");
    let right = {
        let server = Server::start(&[&data]);
        let right = block_on(answers(&server));
        // after a sudden end the database looks through all it holds, and finds the damage by itself
        server.stop();
        right
    };
    let good = fs::read(&file).unwrap();
    let used = good.iter().rposition(|byte| *byte != 0).unwrap_or(0) + 1;
    let mut random = Random::new(5);
    let (mut outcomes, mut wrong, mut panics) = (Tally::default(), 0, 0);
    for round in 0..FILES {
        fs::write(&file, damage(&good, used, round, &mut random)).unwrap();
        match Server::try_start(&[], &[&data]) {
            Err(told) => {
                panics += usize::from(told.contains("panicked"));
                outcomes.count("not started, with a message");
            }
            Ok(mut server) => {
                let seen = block_on(look(&server, &right));
                wrong += seen.wrong;
                panics += usize::from(server.log().contains("panicked") || !server.is_alive());
                let all = seen.statuses.of("200") == JOBS;
                let results = if all { "all there".to_owned() } else { "some refused".to_owned() };
                outcomes.count(format!("started, results {results}, a new job {}", seen.new));
            }
        }
    }
    println!("{outcomes}");
    println!("{FILES} damaged files: {wrong} wrong results, {panics} panics");
    missed([
        (format!("{wrong} wrong results"), wrong == 0),
        (format!("{panics} panics"), panics == 0),
    ])
}

/// The results of a few jobs, by their ids.
async fn answers(server: &Server) -> HashMap<String, String> {
    let (client, mut answers) = (Client::new(), HashMap::new());
    for i in 0..JOBS {
        let (status, id) = submit(server, &client, bracket(POINTS + i), None).await;
        assert_eq!(status, 202);
        settled(server, &client, std::slice::from_ref(&id), WAIT).await;
        let text = result(server, &client, &id).await.1;
        answers.insert(id, text);
    }
    answers
}

/// One bit of the head, a block of noise, a few zeros, or one digit within a result, in turns.
fn damage(good: &[u8], used: usize, round: usize, random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let anywhere = random.below(used);
    match round % 4 {
        0 => bytes[random.below(HEAD)] ^= 1 << random.below(8),
        1 => bytes.iter_mut().skip(anywhere).take(512).for_each(|byte| *byte = random.bits() as u8),
        2 => bytes.iter_mut().skip(anywhere).take(64).for_each(|byte| *byte = 0),
        _ => {
            let results: Vec<_> =
                good.windows(RESULT.len()).enumerate().filter(|(_, w)| *w == RESULT).collect();
            let (begin, _) = results[random.below(results.len())];
            let digits = bytes[begin..].iter_mut().take(WITHIN).filter(|b| b.is_ascii_digit());
            // another digit: still a number
            digits.skip(random.below(FEW)).take(1).for_each(|byte| *byte ^= 1);
        }
    }
    bytes
}

struct Seen {
    statuses: Tally,
    wrong: usize,
    new: String,
}

/// What a service on a damaged file gives.
async fn look(server: &Server, right: &HashMap<String, String>) -> Seen {
    let client = Client::new();
    let (mut statuses, mut wrong) = (Tally::default(), 0);
    for (id, text) in right {
        let (status, told) = result(server, &client, id).await;
        wrong += usize::from(status == 200 && told != *text);
        statuses.count(status);
    }
    let (status, id) = submit(server, &client, bracket(POINTS), None).await;
    let new = match status {
        202 => settled(server, &client, &[id], WAIT).await.to_string(),
        _ => format!("{status} {id}"),
    };
    Seen { statuses, wrong, new }
}
