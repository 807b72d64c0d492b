//! gRPC answers of any size: in pieces, as files, compressed, and the limit of those that are one message.

use conicoid::service::message::v1;
use futures::StreamExt;
use prost::Message;
use tonic::{Code, Request, codec::CompressionEncoding, transport::Channel};
use v1::{jobs_client::JobsClient, segmentations_client::SegmentationsClient};

use super::support::{Running, clouds, location, reason, start};

/// What clients take of one message where nobody says otherwise.
const CLIENTS_TAKE: u64 = 4_194_304;

fn upload(request: v1::SegmentRequest, cloud: &[u8]) -> Vec<v1::Upload> {
    upload_as(v1::UploadStart { request: Some(request), ..Default::default() }, cloud)
}

fn upload_as(start: v1::UploadStart, cloud: &[u8]) -> Vec<v1::Upload> {
    use v1::upload::Part;
    let chunks = cloud.chunks(1 << 18).map(|chunk| Part::Chunk(chunk.to_vec().into()));
    let parts = std::iter::once(Part::Start(start)).chain(chunks);
    parts.map(|part| v1::Upload { part: Some(part) }).collect()
}

/// Clients with no setting changed.
async fn plain(running: &Running) -> (SegmentationsClient<Channel>, JobsClient<Channel>) {
    let channel = running.channel().await;
    (SegmentationsClient::new(channel.clone()), JobsClient::new(channel))
}

async fn merged(mut pieces: tonic::Streaming<v1::Segmentation>) -> (v1::Segmentation, usize) {
    let (mut merged, mut longest) = (v1::Segmentation::default(), 0);
    while let Some(piece) = pieces.message().await.unwrap() {
        longest = longest.max(piece.encoded_len());
        merged.merge(piece.encode_to_vec().as_slice()).unwrap();
    }
    (merged, longest)
}

fn untimed(answer: v1::Segmentation) -> v1::Segmentation {
    v1::Segmentation { timing: None, ..answer }
}

#[tokio::test]
async fn the_pieces_of_an_answer_are_the_answer_from_a_call_and_from_a_job() {
    let running = start(&[]).await;
    let (mut calls, mut jobs) = plain(&running).await;
    let cloud = clouds::ply(&clouds::bracket(200_000));
    let parts = || futures::stream::iter(upload(v1::SegmentRequest::default(), &cloud));
    let whole = untimed(calls.segment_upload(parts()).await.unwrap().into_inner());
    assert_eq!(whole.labels.len(), 200_000);
    let (streamed, longest) =
        merged(calls.segment_stream(parts()).await.unwrap().into_inner()).await;
    assert!(untimed(streamed) == whole && longest < CLIENTS_TAKE as usize);
    let place = location(&running.submit("", cloud.clone()).await);
    running.events(&place).await;
    let id = place.rsplit('/').next().unwrap().to_owned();
    let ask = |omit_labels| v1::GetJobResultRequest {
        id: id.clone(),
        omit_labels,
        max_answer_bytes: None,
    };
    let pieces = jobs.stream_job_result(ask(false)).await.unwrap().into_inner();
    assert!(untimed(merged(pieces).await.0) == whole);
    let pieces = jobs.stream_job_result(ask(true)).await.unwrap().into_inner();
    assert!(untimed(merged(pieces).await.0) == v1::Segmentation { labels: Vec::new(), ..whole });
}

#[tokio::test]
async fn a_client_with_its_own_limits_takes_five_million_labels_in_pieces_and_is_told_of_them() {
    let running = start(&[]).await;
    let (mut calls, mut jobs) = plain(&running).await;
    let cloud = clouds::ply(&clouds::bracket(5_000_000));
    // what is asked for little work: the answer is as long as any
    let quick = || v1::SegmentRequest {
        parameters: Some(v1::Parameters {
            method: v1::Method::Rcond.into(),
            max_regions: Some(1),
            ..Default::default()
        }),
        ..Default::default()
    };
    let parts = |request| futures::stream::iter(upload(request, &cloud));
    let refused = calls.segment_upload(parts(quick())).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::ResourceExhausted, "answer_too_large".to_owned()));
    assert!(refused.message().contains("SegmentStream"), "{}", refused.message());
    let pieces = calls.segment_stream(parts(quick())).await.unwrap().into_inner();
    let (whole, longest) = merged(pieces).await;
    assert_eq!(whole.labels.len(), 5_000_000);
    assert!(longest < CLIENTS_TAKE as usize, "{longest}");
    let job = jobs.submit_job(parts(quick())).await.unwrap().into_inner();
    let watch = v1::GetJobRequest { id: job.id.clone() };
    jobs.watch_job(watch).await.unwrap().into_inner().for_each(|_| async {}).await;
    let ask = |max_answer_bytes| v1::GetJobResultRequest {
        id: job.id.clone(),
        max_answer_bytes,
        ..Default::default()
    };
    let refused = jobs.get_job_result(ask(None)).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::ResourceExhausted, "answer_too_large".to_owned()));
    assert!(refused.message().contains("StreamJobResult"), "{}", refused.message());
    let pieces = jobs.stream_job_result(ask(None)).await.unwrap().into_inner();
    assert!(merged(pieces).await.0.labels == whole.labels);
    // callers who take more say so
    let mut jobs = jobs.max_decoding_message_size(64 << 20);
    let more = jobs.get_job_result(ask(Some(64 << 20))).await.unwrap().into_inner();
    assert!(more.labels == whole.labels);
    let more = v1::SegmentRequest { max_answer_bytes: Some(64 << 20), ..quick() };
    let mut calls = calls.max_decoding_message_size(64 << 20);
    let more = calls.segment_upload(parts(more)).await.unwrap().into_inner();
    assert!(more.labels == whole.labels);
}

#[tokio::test]
async fn an_answer_is_as_long_as_its_limit_and_no_longer() {
    let running = start(&[]).await;
    let (mut calls, _) = plain(&running).await;
    let cloud: bytes::Bytes = clouds::xyz(&clouds::cylinder(2000)).into();
    let ask = |most| v1::SegmentRequest {
        cloud: cloud.clone(),
        max_answer_bytes: most,
        ..Default::default()
    };
    // the times that it tells take the same bytes whatever they are
    let bytes = calls.segment(ask(None)).await.unwrap().into_inner().encoded_len() as u64;
    assert!(calls.segment(ask(Some(bytes))).await.is_ok());
    let refused = calls.segment(ask(Some(bytes - 1))).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::ResourceExhausted, "answer_too_large".to_owned()));
    let without = v1::SegmentRequest { omit_labels: true, ..ask(Some(bytes - 2000)) };
    assert!(calls.segment(without).await.is_ok());
}

#[tokio::test]
async fn every_file_comes_in_chunks_as_over_http() {
    let running = start(&[]).await;
    let (mut calls, mut jobs) = plain(&running).await;
    let cloud = clouds::ply(&clouds::bracket(20_000));
    let place = location(&running.submit("", cloud.clone()).await);
    running.events(&place).await;
    let id = place.rsplit('/').next().unwrap().to_owned();
    for (form, accept) in [
        (v1::Representation::Json, "application/json"),
        (v1::Representation::Protobuf, "application/x-protobuf"),
        (v1::Representation::Npy, "application/x-npy"),
        (v1::Representation::Ply, "model/ply"),
        (v1::Representation::Csv, "text/csv"),
        (v1::Representation::Deviations, "application/vnd.conicoid.deviations+npy"),
        (v1::Representation::Points, "application/vnd.conicoid.points+csv"),
        (v1::Representation::Step, "model/step"),
        (v1::Representation::Html, "text/html"),
        (v1::Representation::Png, "image/png"),
        (v1::Representation::Qif, "application/vnd.conicoid.qif+xml"),
        (v1::Representation::Dmis, "application/vnd.conicoid.dmis"),
        (v1::Representation::Characteristics, "application/vnd.conicoid.characteristics+csv"),
    ] {
        let url = running.url(&format!("{place}/result"));
        let request = reqwest::Client::new().get(url).header("accept", accept);
        let expected = request.send().await.unwrap().bytes().await.unwrap();
        let ask = v1::GetJobFileRequest { id: id.clone(), representation: form.into() };
        let chunks = jobs.get_job_file(ask).await.unwrap().into_inner();
        assert!(file(chunks).await == expected, "{accept} from a job");
        let start = v1::UploadStart { representation: form.into(), ..Default::default() };
        let parts = futures::stream::iter(upload_as(start, &cloud));
        let direct = file(calls.segment_file(parts).await.unwrap().into_inner()).await;
        let timed = ["application/json", "application/x-protobuf"].contains(&accept);
        assert!(timed || direct == expected, "{accept} from a call");
        assert!(!direct.is_empty());
    }
    let parts = futures::stream::iter(upload_as(v1::UploadStart::default(), &cloud));
    let refused = calls.segment_file(parts).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::InvalidArgument, "invalid_parameter".to_owned()));
    assert!(refused.message().contains("STEP"), "{}", refused.message());
}

async fn file(mut chunks: tonic::Streaming<v1::FileChunk>) -> Vec<u8> {
    let mut bytes = Vec::new();
    while let Some(chunk) = chunks.message().await.unwrap() {
        assert!((chunk.data.len() as u64) < CLIENTS_TAKE);
        bytes.extend_from_slice(&chunk.data);
    }
    bytes
}

#[tokio::test]
async fn messages_come_and_go_compressed() {
    let running = start(&[]).await;
    let cloud: bytes::Bytes = clouds::xyz(&clouds::cylinder(2000)).into();
    let message = || v1::SegmentRequest { cloud: cloud.clone(), ..Default::default() };
    let (mut plain, _) = plain(&running).await;
    let expected = plain.segment(message()).await.unwrap();
    assert!(expected.metadata().get("grpc-encoding").is_none());
    let expected = untimed(expected.into_inner());
    for (packing, name) in
        [(CompressionEncoding::Gzip, "gzip"), (CompressionEncoding::Zstd, "zstd")]
    {
        let mut calls = SegmentationsClient::new(running.channel().await)
            .send_compressed(packing)
            .accept_compressed(packing);
        let answer = calls.segment(message()).await.unwrap();
        assert_eq!(answer.metadata().get("grpc-encoding").unwrap(), name);
        assert!(untimed(answer.into_inner()) == expected, "{name}");
        let parts = futures::stream::iter(upload(v1::SegmentRequest::default(), &cloud));
        let pieces = calls.segment_stream(parts).await.unwrap().into_inner();
        assert!(untimed(merged(pieces).await.0) == expected, "{name}");
        let mut health =
            tonic_health::pb::health_client::HealthClient::new(running.channel().await)
                .send_compressed(packing);
        let check = tonic_health::pb::HealthCheckRequest::default();
        assert_eq!(health.check(check).await.unwrap().into_inner().status, 1, "{name}");
    }
    while running.service.bytes_in_flight() > 0 {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn what_a_message_unpacks_to_is_limited_and_counted() {
    let running = start(&["--max-message-bytes=1000000", "--max-bytes-in-flight=30000000"]).await;
    for packing in [CompressionEncoding::Gzip, CompressionEncoding::Zstd] {
        let mut calls = SegmentationsClient::new(running.channel().await).send_compressed(packing);
        let message =
            |bytes| v1::SegmentRequest { cloud: vec![b' '; bytes].into(), ..Default::default() };
        let long = calls.segment(message(1_000_001)).await.unwrap_err();
        assert_eq!(reason(&long), (Code::ResourceExhausted, "body_too_large".to_owned()));
        assert!(long.message().contains("SegmentUpload"), "{}", long.message());
        // this one is read, and is no cloud
        let read = calls.segment(message(900_000)).await.unwrap_err();
        assert_eq!(read.code(), Code::InvalidArgument, "{read}");
        // an upload in packed chunks takes its part of the budget unpacked
        let spaces = vec![b' '; 30_000_001];
        let parts = futures::stream::iter(upload(v1::SegmentRequest::default(), &spaces));
        let full = calls.segment_upload(parts).await.unwrap_err();
        assert_eq!(reason(&full), (Code::ResourceExhausted, "overloaded".to_owned()));
    }
    while running.service.bytes_in_flight() > 0 {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn another_packing_is_refused_with_those_that_are_taken() {
    let running = start(&[]).await;
    let mut call = Request::new(v1::SegmentRequest::default());
    call.metadata_mut().insert("grpc-encoding", "snappy".parse().unwrap());
    let refused = running.grpc().await.segment(call).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::Unimplemented, "unsupported_encoding".to_owned()));
    let taken = refused.metadata().get("grpc-accept-encoding").unwrap().to_str().unwrap();
    assert!(taken.contains("gzip") && taken.contains("zstd"), "{taken}");
}
