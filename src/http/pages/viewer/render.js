// Points in three dimensions, by WebGL 2: one disc a point, lit by its surface's normal, in the colour of its surface or of
// its deviation. What is shown of each region stands in a small texture, so that hiding one or letting one stand out
// moves no points.

/// How a region is drawn.
export const HIDDEN = 0, FAINT = 128, SHOWN = 255;

const VERTEX = `#version 300 es
  in vec3 position; in vec3 normal; in int label; in float deviation;
  uniform mat4 matrix; uniform vec3 back; uniform vec3 lamp; uniform float size; uniform sampler2D regions; uniform float limit;
  flat out vec3 shade;
  vec3 ramp(float t) {
    // blue below, red above, and grey about zero
    vec3 low = vec3(0.13, 0.40, 0.67), middle = vec3(0.87, 0.86, 0.84), high = vec3(0.70, 0.09, 0.17);
    return t < 0.0 ? mix(middle, low, sqrt(min(-t, 1.0))) : mix(middle, high, sqrt(min(t, 1.0)));
  }
  void main() {
    int at = label + 1;
    vec4 region = texelFetch(regions, ivec2(at % 1024, at / 1024), 0);
    // where deviations are looked at, each point stands on its surface: else the nearer half of the noise hides the other
    bool lies = dot(normal, normal) > 0.0;
    vec3 n = lies ? normalize(normal) : vec3(0.0);
    gl_Position = matrix * vec4(limit > 0.0 ? position - deviation * n : position, 1.0);
    if (region.a < 0.25) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    bool faint = region.a < 0.75;
    // those that stand back, or on no surface, are small, so that what lies behind them shows
    gl_PointSize = clamp(size / gl_Position.w, 1.5, 48.0) * (faint || label < 0 ? 0.45 : 1.0);
    vec3 color = limit > 0.0 && label >= 0 && !faint ? ramp(deviation / limit) : region.rgb;
    float light = 1.0;
    // either side of a surface is lit
    if (lies) light = 0.45 + 0.65 * max(dot(n, lamp) * (dot(n, back) < 0.0 ? -1.0 : 1.0), 0.0);
    shade = faint ? region.rgb : color * light;
  }`;
const FRAGMENT = `#version 300 es
  precision mediump float;
  flat in vec3 shade; out vec4 color;
  void main() {
    vec2 off = gl_PointCoord - 0.5;
    if (dot(off, off) > 0.25) discard;
    color = vec4(shade, 1.0);
  }`;

/// Time for the points of a frame, in milliseconds: more are drawn in the next ones.
const SMOOTH = 30;
/// How many points a frame draws at first, and at least.
const FIRST = 100000, FEWEST = 10000;
const COLUMNS = 1024;

/// Draws on `canvas`; null where the browser has no WebGL 2.
export const renderer = canvas => {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  let program, places, buffers, array, texture, cloud = null, styles = null, normals = null;
  // how many points a frame has time for, and how many are drawn
  let few = FIRST, drawn = 0;

  const shader = (type, source) => {
    const made = gl.createShader(type);
    gl.shaderSource(made, source);
    gl.compileShader(made);
    gl.attachShader(program, made);
  };
  const begin = () => {
    program = gl.createProgram();
    shader(gl.VERTEX_SHADER, VERTEX);
    shader(gl.FRAGMENT_SHADER, FRAGMENT);
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    places = Object.fromEntries(["matrix", "back", "lamp", "size", "regions", "limit"].map(name => [name, gl.getUniformLocation(program, name)]));
    buffers = Object.fromEntries(["position", "normal", "label", "deviation"].map(name => [name, gl.createBuffer()]));
    array = gl.createVertexArray();
    gl.bindVertexArray(array);
    texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  };
  const fill = (name, data, size, type, normalized) => {
    const at = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(at);
    if (type === gl.INT) gl.vertexAttribIPointer(at, size, type, 0, 0);
    else gl.vertexAttribPointer(at, size, type, normalized, 0, 0);
  };
  const load = () => {
    fill("position", cloud.positions, 3, gl.FLOAT, false);
    fill("normal", normals, 3, gl.BYTE, true);
    fill("label", cloud.labels, 1, gl.INT, false);
    // not a number is for shaders to make anything of
    fill("deviation", cloud.deviations.map(value => value || 0), 1, gl.FLOAT, false);
  };
  const style = () => {
    const rows = Math.ceil(styles.length / 4 / COLUMNS), texels = new Uint8Array(4 * COLUMNS * rows);
    texels.set(styles);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, COLUMNS, rows, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels);
  };
  begin();
  canvas.addEventListener("webglcontextlost", event => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    begin();
    if (cloud) load();
    if (styles) style();
    canvas.dispatchEvent(new Event("again"));
  });

  return {
    gl,
    /// Takes a cloud with the normals of its surfaces.
    show(points, directions) {
      [cloud, normals] = [points, directions];
      load();
    },
    /// Takes red, green, blue and HIDDEN, FAINT or SHOWN of each label, that of -1 first.
    style(all) {
      styles = all;
      style();
    },
    /// Begins to draw: as many points as a frame has time for. `limit` is the deviation with the deepest colour, 0 for
    /// the colours of the surfaces; while the view `moves` the points drawn first are all, and larger. Whether more are
    /// to come by `more`.
    draw({ matrix, axes: [right, up, back], size, limit, background, moves }) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(...background, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.uniformMatrix4fv(places.matrix, false, matrix);
      gl.uniform3fv(places.back, back);
      // above the left shoulder of who looks
      gl.uniform3fv(places.lamp, back.map((b, k) => 0.817 * b + 0.48 * up[k] - 0.32 * right[k]));
      gl.uniform1f(places.size, size * (moves ? Math.min(4, Math.sqrt(Math.max(1, cloud.count / few))) : 1));
      gl.uniform1f(places.limit, limit);
      drawn = 0;
      return this.more();
    },
    /// Draws on; whether there is more.
    more() {
      const part = Math.min(cloud.count - drawn, few), begun = performance.now();
      gl.drawArrays(gl.POINTS, drawn, part);
      drawn += part;
      // reading one pixel waits for the drawing
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      const took = Math.max(1, performance.now() - begun);
      if (part === few || took > SMOOTH) few = Math.max(FEWEST, Math.round(few * Math.min(2, Math.max(0.2, SMOOTH / took))));
      return drawn < cloud.count;
    },
  };
};

/// The colour of a deviation of `share` of the limit, as the shader has it.
export const ramp = share => {
  const low = [0.13, 0.40, 0.67], middle = [0.87, 0.86, 0.84], high = [0.70, 0.09, 0.17];
  const part = Math.sqrt(Math.min(1, Math.abs(share))), end = share < 0 ? low : high;
  return middle.map((m, k) => Math.round(255 * (m + part * (end[k] - m))));
};
