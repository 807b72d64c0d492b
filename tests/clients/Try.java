package tried;

import java.io.File;
import java.lang.reflect.Method;
import java.lang.reflect.Parameter;
import java.util.List;
import java.util.Map;
import java.util.Set;
import org.openapitools.client.ApiClient;
import org.openapitools.client.api.JobsApi;
import org.openapitools.client.api.SegmentationsApi;
import org.openapitools.client.model.*;

public class Try {
    static void expect(boolean good, String what) {
        if (!good) throw new IllegalStateException(what);
        System.out.println("ok: " + what);
    }

    // A call by the names of its parameters, of which there are three dozen: lists that are not given are empty.
    @SuppressWarnings("unchecked")
    static <T> T call(Object api, String name, Map<String, Object> given) throws Exception {
        for (Method method : api.getClass().getMethods()) {
            Parameter[] parameters = method.getParameters();
            boolean headers = parameters.length > 0 && parameters[parameters.length - 1].getName().equals("headers");
            if (!method.getName().equals(name) || headers) continue;
            Object[] values = new Object[parameters.length];
            for (int k = 0; k < values.length; k++) {
                Class<?> type = parameters[k].getType();
                Object none = type == List.class ? List.of() : type == Set.class ? Set.of() : null;
                values[k] = given.getOrDefault(parameters[k].getName(), none);
            }
            return (T) method.invoke(api, values);
        }
        throw new IllegalStateException("no " + name);
    }

    public static void main(String[] arguments) throws Exception {
        ApiClient client = new ApiClient();
        client.updateBaseUri(arguments[0]);
        File cloud = new File(arguments[1]);
        SegmentationsApi segmentations = new SegmentationsApi(client);
        JobsApi jobs = new JobsApi(client);
        // this generator's client sends a bare file as the JSON of its name, and an object in a form as what toString makes
        // of it: so the cloud comes in forms, and parameters in parts of their own
        Document plain = call(segmentations, "createSegmentationFromForm", Map.of("cloud", cloud));
        expect(plain.getLabels().size() == 400, "a form without parameters");
        Cylinder cylinder = plain.getRegions().get(0).getSurface().getCylinder();
        expect(Math.abs(cylinder.getRadius() - 10) < 1e-3, "its surface is a cylinder with a radius");
        Document form = call(segmentations, "createSegmentationFromForm", Map.of("cloud", cloud, "seed", 1L, "merge", false));
        expect(form.getParameters().getSeed() == 1 && !form.getParameters().getMerge(), "a form with parameters");
        JobDocument job = call(jobs, "createJobFromForm", Map.of("cloud", cloud));
        expect(job.getCreatedMs() > 1_000_000_000_000L, "a job");
        JobDocument other = call(jobs, "createJobFromForm", Map.of("cloud", cloud, "wait", 60.0, "idempotencyKey", "once", "seed", 2L));
        expect(other.getState() == JobState.SUCCEEDED, "a job from a form");
        JobList list = jobs.listJobs(null, 1L, null);
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
