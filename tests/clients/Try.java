package tried;

import java.io.File;
import java.util.List;
import org.openapitools.client.ApiClient;
import org.openapitools.client.api.JobsApi;
import org.openapitools.client.api.SegmentationsApi;
import org.openapitools.client.model.*;

public class Try {
    static void expect(boolean good, String what) {
        if (!good) throw new IllegalStateException(what);
        System.out.println("ok: " + what);
    }

    public static void main(String[] arguments) throws Exception {
        ApiClient client = new ApiClient();
        client.updateBaseUri(arguments[0]);
        File cloud = new File(arguments[1]);
        SegmentationsApi segmentations = new SegmentationsApi(client);
        JobsApi jobs = new JobsApi(client);
        // this generator's client sends a bare file as the JSON of its name, and an object in a form as what toString makes
        // of it: so the cloud comes in forms, and parameters in parts of their own
        Document plain = segmentations.createSegmentationFromForm(cloud, null);
        expect(plain.getLabels().size() == 400, "a form without parameters");
        Cylinder cylinder = plain.getRegions().get(0).getSurface().getCylinder();
        expect(Math.abs(cylinder.getRadius() - 10) < 1e-3, "its surface is a cylinder with a radius");
        SegmentationParameters parameters = new SegmentationParameters().seed(1L).merge(false);
        Document form = segmentations.createSegmentationFromForm(cloud, parameters);
        expect(form.getParameters().getSeed() == 1 && !form.getParameters().getMerge(), "a form with parameters");
        JobDocument job = jobs.createJobFromForm(cloud, null, null, null);
        expect(job.getCreatedMs() > 1_000_000_000_000L, "a job");
        JobDocument other = jobs.createJobFromForm(cloud, 60.0, "once", new SegmentationParameters().seed(2L));
        expect(other.getState() == JobState.SUCCEEDED, "a job from a form");
        JobList list = jobs.listJobs(null, 1, null);
        expect(list.getJobs().get(0).getId().equals(other.getId()), "the first page of the list");
        JobList rest = jobs.listJobs(List.of(JobState.SUCCEEDED, JobState.QUEUED, JobState.RUNNING), null, list.getNextPageToken());
        expect(rest.getJobs().size() == 1 && rest.getJobs().get(0).getId().equals(job.getId()), "the next page");
        expect(jobs.getJob(job.getId(), 60.0).getState() == JobState.SUCCEEDED, "the end of a job");
        expect(jobs.getJobResult(other.getId(), null, 60.0).getParameters().getSeed() == 2, "the result");
        jobs.deleteJob(job.getId());
        jobs.deleteJob(other.getId());
        expect(jobs.listJobs(null, null, null).getJobs().isEmpty(), "no job left");
    }
}
