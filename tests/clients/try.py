import io
import sys

from conicoid_client import Client
from conicoid_client.api.fits import create_fit, create_fit_from_form
from conicoid_client.api.jobs import create_job, create_job_from_form, delete_job, get_job, get_job_result, list_jobs
from conicoid_client.api.segmentations import create_segmentation, create_segmentation_from_form
from conicoid_client.models import Cylinder, FitForm, FitFormParameters, FitFormType, JobState, SegmentationForm, SegmentationFormSurfacesItem, SegmentationParameters
from conicoid_client.types import File


def expect(good, what):
    assert good, what
    print("ok:", what)


client = Client(base_url=sys.argv[1], timeout=60)
with open(sys.argv[2], "rb") as file:
    text = file.read()
cloud = lambda: File(payload=io.BytesIO(text), file_name="cloud.xyz")
form = lambda **more: SegmentationForm(cloud=cloud(), parameters=SegmentationParameters(**more))

bare = create_segmentation.sync(client=client, body=cloud(), min_points=60)
expect(len(bare.labels) == 400, "a bare cloud")
surface = bare.regions[0].surface
expect(isinstance(surface, Cylinder) and abs(surface.radius - 10) < 1e-3, "its surface is a cylinder with a radius")
answer = create_segmentation_from_form.sync(client=client, body=form(seed=1, merge=False))
expect(answer.parameters.seed == 1 and not answer.parameters.merge, "a form with parameters")
flat = SegmentationForm(cloud=cloud(), seed=3, merge=False, surfaces=[SegmentationFormSurfacesItem("plane"), SegmentationFormSurfacesItem("cylinder")])
answer = create_segmentation_from_form.sync(client=client, body=flat)
expect(answer.parameters.seed == 3 and len(answer.parameters.surfaces) == 2, "a form with a part for each")
expect(create_segmentation_from_form.sync(client=client, body=SegmentationForm(cloud=cloud())).regions, "a form without")
fit = create_fit.sync(client=client, body=cloud())
expect(isinstance(fit.surface, Cylinder), "a fit")
for body in FitForm(cloud=cloud(), type_=FitFormType.CYLINDER, part="p"), FitForm(cloud=cloud(), parameters=FitFormParameters.from_dict({"type": "cylinder", "part": "p"})):
    again = create_fit_from_form.sync(client=client, body=body)
    expect(again.surface == fit.surface and again.passed.part == "p", "a fit of a form")
job = create_job.sync(client=client, body=cloud(), wait=60, idempotency_key="once")
expect(job.state == JobState.SUCCEEDED, "a job")
expect(create_job.sync(client=client, body=cloud(), idempotency_key="once").id == job.id, "the same job again")
other = create_job_from_form.sync(client=client, body=form(seed=2))
page = list_jobs.sync(client=client, page_size=1)
expect([entry.id for entry in page.jobs] == [other.id], "the first page of the list")
rest = list_jobs.sync(client=client, page_token=page.next_page_token, state=[JobState.SUCCEEDED])
expect([entry.id for entry in rest.jobs] == [job.id], "the next page")
expect(get_job.sync(client=client, id=other.id, wait=60).state == JobState.SUCCEEDED, "the end of a job")
expect(get_job_result.sync(client=client, id=other.id).parameters.seed == 2, "the result")
for entry in job, other:
    delete_job.sync(client=client, id=entry.id)
expect(list_jobs.sync(client=client).jobs == [], "no job left")
