"""What schemathesis cannot know of the contract: which bytes are a point cloud.

A schema says "binary", and random bytes are no cloud: the service is right to refuse them. So a request
that is meant to be good gets a small cloud as its body, under that cloud's format; a direction of length
zero, which no schema excludes, is left out. Requests that are meant to be wrong stay as they are.
"""

import http.client
import math
import urllib.error
import urllib.request
import uuid

import schemathesis

POINTS = [(10 * math.cos(2.4 * i), 10 * math.sin(2.4 * i), i / 10) for i in range(100)]
CLOUD = "".join(f"{x:.4f} {y:.4f} {z:.1f}\n" for x, y, z in POINTS)
TAKE_A_CLOUD = {"createSegmentation", "createSegmentationFromForm", "createJob", "createJobFromForm"}


@schemathesis.hook
def before_call(context, case, **kwargs):
    operation = case.operation.definition.raw.get("operationId")
    if operation == "deleteJob":
        wait_for_the_end(case)
    elif operation in TAKE_A_CLOUD and case.meta is not None:
        if all(component.mode.is_positive for component in case.meta.components.values()):
            give_a_cloud(case)


def wait_for_the_end(case):
    """DELETE forgets a job that has ended; one under way it cancels, and that stays to be seen."""
    events = f"{case.operation.base_url.rstrip('/')}{case.formatted_path}/events"
    try:
        with urllib.request.urlopen(events, timeout=10) as stream:
            stream.read()
    except (urllib.error.URLError, ValueError, http.client.HTTPException):
        pass  # there is no such job


def is_zero(direction):
    """Numbers may be text by now."""
    numbers = direction.split(",") if isinstance(direction, str) else direction
    return all(float(number) == 0 for number in numbers)


def give_a_cloud(case):
    parameters = case.body.get("parameters") if isinstance(case.body, dict) else None
    if isinstance(case.body, dict):
        case.body["cloud"] = CLOUD
    else:
        case.body = CLOUD.encode()
    for given in (case.query, parameters):
        if isinstance(given, dict):
            # what asks for more points or more time than this cloud is about
            for name in ("format", "deadline", "max_failed_seeds", "min_points"):
                given.pop(name, None)
            if "axis_direction" in given and is_zero(given["axis_direction"]):
                del given["axis_direction"]
    headers = dict(case.headers or {})
    if "Idempotency-Key" in headers:
        headers["Idempotency-Key"] = str(uuid.uuid4())  # a key stands for one submission
    case.headers = headers
