import { readFileSync } from "fs";
import { Configuration, JobsApi, JobState, SegmentationsApi } from "./index";

const expect = (good: boolean, what: string) => {
  if (!good) throw new Error(what);
  console.log("ok:", what);
};

const main = async () => {
  const [url, file] = process.argv.slice(2);
  const configuration = new Configuration({ basePath: url });
  const segmentations = new SegmentationsApi(configuration), jobs = new JobsApi(configuration);
  const cloud = new Blob([readFileSync(file)]);
  const bare = await segmentations.createSegmentation({ body: cloud, minPoints: 60 });
  const surface = bare.regions[0].surface;
  expect(bare.labels?.length === 400, "a bare cloud");
  expect(surface?.type === "cylinder" && Math.abs(surface.radius - 10) < 1e-3, "its surface is a cylinder with a radius");
  const form = await segmentations.createSegmentationFromForm({ cloud, parameters: { seed: 1, surfaces: ["plane", "cylinder"] } });
  expect(form.parameters.seed === 1 && form.regions.length > 0, "a form with parameters");
  const flat = await segmentations.createSegmentationFromForm({ cloud, seed: 3, surfaces: ["plane", "cylinder"], merge: false });
  expect(flat.parameters.seed === 3 && flat.parameters.surfaces.length === 2 && !flat.parameters.merge, "a form with a part for each");
  const job = await jobs.createJob({ body: cloud, wait: 60, idempotencyKey: "once" });
  expect(job.state === JobState.Succeeded && job.createdMs > 1e12, "a job");
  const again = await jobs.createJob({ body: cloud, idempotencyKey: "once" });
  expect(again.id === job.id, "the same job again");
  const other = await jobs.createJobFromForm({ cloud, parameters: { seed: 2 } });
  const list = await jobs.listJobs({ pageSize: 1 });
  expect(list.jobs[0].id === other.id && list.nextPageToken !== undefined, "the first page of the list");
  const rest = await jobs.listJobs({ pageToken: list.nextPageToken, state: [JobState.Succeeded] });
  expect(rest.jobs.length === 1 && rest.jobs[0].id === job.id, "the next page");
  const result = await jobs.getJobResult({ id: other.id, wait: 60 });
  expect(result.parameters.seed === 2 && result.labels?.length === 400, "the result");
  await jobs.deleteJob({ id: job.id });
  await jobs.deleteJob({ id: other.id });
  expect((await jobs.listJobs({})).jobs.length === 0, "no job left");
};

main().catch(error => {
  console.error(error);
  process.exit(1);
});
