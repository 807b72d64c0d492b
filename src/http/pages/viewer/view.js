// The view: draws when something changed, and turns what fingers, mouse and keys do into movements and clicks.

import { VIEWS, axes, camera as placed, fitted, matrix, pick, scale } from "./camera.js";
import { $ } from "./dom.js";
import { overlay } from "./overlay.js";
import { renderer } from "./render.js";

const DARK = matchMedia("(prefers-color-scheme: dark)");
/// A pointer that moved no farther than this has clicked, in pixels.
const CLICK = 4;
/// The view has come to rest when nothing moved it for so long, in milliseconds.
const REST = 160;

/// Colours of the page as canvases need them.
export const theme = () => DARK.matches
  ? { isDark: true, back: "#0e1117", ink: "#e6e9f0", accent: "#6db3ff", faint: [58, 62, 72], ground: [0.055, 0.067, 0.09] }
  : { isDark: false, back: "#ffffff", ink: "#1d2330", accent: "#0b62c4", faint: [196, 201, 210], ground: [1, 1, 1] };

/// The view over the page's two canvases. `on.click(index, more)` and `on.doubleClick(index)` get the point that was
/// hit, -1 for none; `on.drawn()` is told when all points stand. null where the browser has no WebGL 2.
export const view = on => {
  const canvas = $("view"), over = $("over"), ink = over.getContext("2d"), render = renderer(canvas);
  if (!render) return null;
  let cloud = null, camera = placed(1), rest = 0, next = 0;
  const shown = { isShown: () => true, limit: 0, picks: [], distance: 0 };

  const sizes = () => {
    const density = window.devicePixelRatio || 1;
    return { width: canvas.clientWidth, height: canvas.clientHeight, density };
  };
  const current = () => matrix(camera, canvas.clientWidth / canvas.clientHeight, cloud.reach);
  /// Width of a disc in pixels times its depth: discs of points in no order leave one place in two hundred open.
  const size = height => 3.6 * cloud.spacing * scale({ ...camera, distance: camera.flat ? camera.distance : 1 }, height);

  /// Begins to draw; whether there is more.
  const paint = moves => {
    const { width, height, density } = sizes(), colors = theme();
    if (!cloud || !width || !height) return false;
    for (const each of [canvas, over]) {
      const [w, h] = [Math.round(width * density), Math.round(height * density)];
      if (each.width !== w || each.height !== h) [each.width, each.height] = [w, h];
    }
    const now = current();
    const isMore = render.draw({ matrix: now, axes: axes(camera), size: size(height * density), limit: shown.limit, background: colors.ground, moves });
    overlay(ink, { ...shown, camera, matrix: now, width, height, density, colors });
    return isMore;
  };
  /// Draws what there is more of, a part in each frame, until something else is to be drawn.
  const go = isMore => {
    if (isMore) next = requestAnimationFrame(() => go(render.more()));
    else on.drawn();
  };
  const redraw = (moves = false) => {
    clearTimeout(rest);
    cancelAnimationFrame(next);
    if (moves) rest = setTimeout(() => redraw(), REST);
    next = requestAnimationFrame(() => {
      const isMore = paint(moves);
      if (!moves && cloud) go(isMore);
    });
  };

  // ---- movements ----

  const pointers = new Map();
  let travelled = 0;
  const place = event => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const hit = at => {
    const { width, height } = sizes();
    return cloud ? pick(cloud, camera, current(), at, width, height, size(height), shown.isShown) : -1;
  };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
    travelled = pointers.size > 1 ? Infinity : 0;
  });
  canvas.addEventListener("pointerup", event => {
    const here = pointers.delete(event.pointerId);
    if (here && cloud && travelled <= CLICK && event.button === 0) on.click(hit(place(event)), event.shiftKey || event.ctrlKey || event.metaKey);
  });
  canvas.addEventListener("pointercancel", event => pointers.delete(event.pointerId));
  const turn = (yaw, pitch) => {
    camera.yaw -= yaw;
    camera.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, camera.pitch + pitch));
  };
  const move = (dx, dy) => {
    const [right, up] = axes(camera), step = 1 / scale(camera, canvas.clientHeight);
    camera.target = camera.target.map((t, i) => t - step * (dx * right[i] - dy * up[i]));
  };
  /// Brings what is at `at` nearer, and leaves it there.
  const zoom = (factor, at) => {
    const { width, height } = sizes(), [dx, dy] = [at[0] - width / 2, at[1] - height / 2];
    move(-dx, -dy);
    camera.distance = Math.max(1e-4 * cloud.radius, Math.min(30 * cloud.reach, camera.distance * factor));
    move(dx, dy);
  };
  canvas.addEventListener("pointermove", event => {
    const before = pointers.get(event.pointerId);
    if (!before || !cloud) return;
    const now = place(event), [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    travelled += Math.hypot(dx, dy);
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    pointers.set(event.pointerId, now);
    if (!other && travelled <= CLICK) return;
    if (other) {
      const apart = p => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      zoom(apart(before) / apart(now), [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
      // the middle between two fingers goes half as far as one of them
      move(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) {
      move(dx, dy);
    } else {
      turn(dx / 150, dy / 150);
    }
    redraw(true);
  });
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    if (!cloud) return;
    // some mice tell lines, not pixels
    zoom(Math.exp(event.deltaY * (event.deltaMode ? 20 : 1) / 800), place(event));
    redraw(true);
  }, { passive: false });
  canvas.addEventListener("keydown", event => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!cloud || !(step || ["+", "-", "="].includes(event.key)) || event.ctrlKey || event.metaKey) return;
    if (step) turn(...step);
    else camera.distance *= event.key === "-" ? 1.1 : 0.9;
    event.preventDefault();
    redraw(true);
  });
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("dblclick", event => cloud && on.doubleClick(hit(place(event))));
  canvas.addEventListener("again", () => redraw());
  new ResizeObserver(() => redraw()).observe(canvas);
  DARK.addEventListener("change", () => on.theme());

  return {
    /// Shows a cloud with the normals of its surfaces; where `keeps`, the camera stays.
    show(points, normals, keeps) {
      cloud = points;
      render.show(cloud, normals);
      if (!keeps) {
        camera = { ...placed(cloud.radius), flat: camera.flat };
        const found = cloud.labels.some(label => label >= 0);
        this.fit(label => label >= 0 || !found);
      }
      redraw();
    },
    /// Takes what each label looks like, and which deviation has the deepest colour.
    style(texels, isShown, limit) {
      Object.assign(shown, { isShown, limit });
      render.style(texels);
      redraw();
    },
    measured(picks, distance) {
      Object.assign(shown, { picks, distance });
      redraw();
    },
    /// Fits points into the view: those whose label `has`.
    fit(has) {
      camera = fitted(cloud, camera, canvas.clientWidth / canvas.clientHeight || 1, has);
      redraw();
    },
    stand(name) {
      [camera.yaw, camera.pitch] = VIEWS[name];
      redraw();
    },
    flat(on) {
      camera.flat = on;
      redraw();
    },
    /// What is seen, as a PNG file.
    picture() {
      cancelAnimationFrame(next);
      if (paint(false)) while (render.more());
      const all = document.createElement("canvas");
      [all.width, all.height] = [canvas.width, canvas.height];
      const ink = all.getContext("2d");
      for (const layer of [canvas, over]) ink.drawImage(layer, 0, 0);
      return new Promise(done => all.toBlob(done, "image/png"));
    },
    /// Where it stands, for whoever compares.
    camera: () => ({ ...camera }),
  };
};
