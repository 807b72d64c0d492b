// The service as the page calls it.

/// An answer that is none: the problem document's words, and its status.
export class Problem extends Error {
  constructor(status, text) {
    super(text);
    this.status = status;
  }
}

let key = null;
let askForKey = async () => null;

/// `ask` gets whether a key was refused, and answers with another one, or null to give up.
export const onKeyWanted = ask => { askForKey = ask; };

/// Calls the service; asks for a key, once or more, where it wants one.
export const call = async (path, options = {}) => {
  for (let refused = false; ; refused = true) {
    const headers = { ...options.headers, ...(key && { Authorization: "Bearer " + key }) };
    const answer = await fetch(path, { ...options, headers });
    if (answer.ok) return answer;
    const problem = await answer.json().catch(() => ({ title: "The service answers " + answer.status }));
    const text = [problem.title, problem.detail, problem.code && `${problem.code}, request ${problem.request_id}`];
    if (answer.status !== 401) throw new Problem(answer.status, text.filter(Boolean).join("\n"));
    const other = await askForKey(refused && key !== null);
    if (other === null) throw new Problem(answer.status, text.filter(Boolean).join("\n"));
    key = other;
  }
};

/// Sends a cloud as a job, with what a person knows of it: where it is.
export const submit = async (cloud, query, hints) => {
  const form = new FormData();
  if (hints.length) form.append("parameters", JSON.stringify({ hints }));
  form.append("cloud", cloud, "cloud");
  const accepted = await call("/v1/segmentations?" + query, { method: "POST", body: form, headers: { Prefer: "respond-async" } });
  return accepted.headers.get("location");
};

/// Follows the events of a job to its end: the job as it ended.
export const follow = async (place, show) => {
  const reader = (await call(place + "/events")).body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "", job;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return job;
    const lines = (rest + value).split("\n");
    rest = lines.pop();
    for (const line of lines.filter(line => line.startsWith("data:"))) show(job = JSON.parse(line.slice(5)));
  }
};

/// The result of a job in one of its forms.
export const result = (place, type) => call(place + "/result", { headers: { Accept: type } });
export const document = place => call(place + "/result?labels=none").then(answer => answer.json());
export const cancel = place => call(place, { method: "DELETE" });

/// The contract: the parameters that a form asks for, and the forms in which results come.
export const contract = async () => {
  const api = await (await fetch("/openapi.json")).json();
  const { parameters } = api.paths["/v1/segmentations"].post;
  const forms = Object.keys(api.paths["/v1/jobs/{id}/result"].get.responses["200"].content);
  return { parameters: parameters.filter(p => p.in === "query" && !["labels", "name", "hints"].includes(p.name)), forms };
};
