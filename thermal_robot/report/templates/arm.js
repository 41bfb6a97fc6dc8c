"use strict";
(() => {
  const box = document.getElementById("tr-arm");
  const data = JSON.parse(document.getElementById("tr-arm-data").textContent);
  const canvas = box.querySelector("canvas"), pen = canvas.getContext("2d");
  const part = name => box.querySelector(`[data-tr="${name}"]`);
  const slider = part("row"), longer = part("longer"), told = part("told"), times = part("times");
  const view = { yaw: -0.9, pitch: 0.42, zoom: 1 };
  const START = { ...view };
  let colours = {}, width = 0, height = 0, asked = false;

  /* vectors of three numbers */
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const less = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const along = (a, b, k) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = a => { const n = Math.hypot(...a) || 1; return a.map(v => v / n); };
  /* a pose is twelve numbers: three rows of rotation and position */
  const placed = (t, p) => [0, 4, 8].map(k => t[k] * p[0] + t[k + 1] * p[1] + t[k + 2] * p[2] + t[k + 3]);
  const origin = t => [t[3], t[7], t[11]];
  const poses = row => data.links.map((_, k) => row.poses.slice(12 * k, 12 * k + 12));

  /* what is to be seen, arrows too, stays within a ball, however it is turned: the least one, found by going ever
     smaller steps towards the farthest point (Badoiu and Clarkson 2003) */
  const ends = row => [row.before, row.after].map(gap => along(row.at, gap, data.factor));
  const seen = data.rows.flatMap(row => [row.at, ...ends(row), ...poses(row).map(origin)]).concat([[0, 0, 0]]);
  const far = from => seen.map(p => Math.hypot(...less(p, from))).reduce((a, d, k) => d > a[0] ? [d, k] : a, [1e-3, 0]);
  let centre = seen[0];
  for (let k = 2; k < 200; k++) centre = along(centre, less(seen[far(centre)[1]], centre), 1 / k);
  const radius = far(centre)[0];
  const most = Math.max(...[...data.links, ...data.joints, data.base, data.tool].map(place => place.share));

  const rgb = text => text.trim().replace("#", "").match(/../g).map(h => parseInt(h, 16));
  const css = (c, shade = 1, alpha = 1) =>
    `rgba(${c.map(v => Math.round(Math.min(255, v * shade))).join(",")},${alpha})`;
  const byShare = share => {
    const k = most > 0 ? share / most : 0;
    return colours.body.map((v, i) => v + k * (colours.warn[i] - v));
  };

  const read = () => {
    const style = getComputedStyle(box);
    for (const name of ["ink", "muted", "faint", "paper", "before", "after", "body", "warn"])
      colours[name] = rgb(style.getPropertyValue(`--tr-${name}`));
  };

  const draw = () => {
    asked = false;
    const { yaw, pitch, zoom } = view;
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    const towards = [Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch)];
    const up = cross(towards, right);
    const scale = zoom * 0.485 * Math.min(width, height) / radius;
    const onto = p => {
      const d = less(p, centre);
      return [width / 2 + scale * dot(d, right), height / 2 - scale * dot(d, up), dot(d, towards)];
    };
    const items = [];
    const line = (a, b, colour, thick, ahead = 0) => {
      const [p, q] = [onto(a), onto(b)];
      items.push({ depth: (p[2] + q[2]) / 2 + ahead, paint: () => {
        pen.strokeStyle = colour; pen.lineWidth = thick; pen.lineCap = "round";
        pen.beginPath(); pen.moveTo(p[0], p[1]); pen.lineTo(q[0], q[1]); pen.stroke();
      } });
    };
    const arrow = (from, gap, colour, thick, ahead = 0) => {
      const by = data.factor * longer.value;
      const [p, q] = [onto(from), onto(along(from, gap, by))];
      const size = Math.hypot(q[0] - p[0], q[1] - p[1]);
      const head = Math.min(3 + 2.5 * thick, 0.6 * size), turn = Math.atan2(q[1] - p[1], q[0] - p[0]);
      items.push({ depth: (p[2] + q[2]) / 2 + ahead, paint: () => {
        pen.strokeStyle = pen.fillStyle = colour; pen.lineWidth = thick; pen.lineCap = "butt";
        pen.beginPath(); pen.moveTo(p[0], p[1]);
        pen.lineTo(q[0] - 0.7 * head * Math.cos(turn), q[1] - 0.7 * head * Math.sin(turn)); pen.stroke();
        pen.beginPath(); pen.moveTo(q[0], q[1]);
        for (const side of [-0.45, 0.45])
          pen.lineTo(q[0] - head * Math.cos(turn + side), q[1] - head * Math.sin(turn + side));
        pen.fill();
      } });
    };

    const row = data.rows[slider.value], frames = poses(row);
    floor(line);
    plate(onto, items);
    body(frames, onto, towards, right, up, items, line);
    line(origin(frames[frames.length - 1]), row.at, css(byShare(data.tool.share)), 5);
    for (const gap of ["before", "after"]) {
      if (!part(gap).checked) continue;
      for (const other of data.rows) if (other !== row) arrow(other.at, other[gap], css(colours[gap], 1, 0.75), 1.3);
      arrow(row.at, row[gap], css(colours[gap]), 3, 2 * radius);
    }
    pen.setTransform(canvas.width / width, 0, 0, canvas.height / height, 0, 0);
    pen.clearRect(0, 0, width, height);
    items.sort((a, b) => a.depth - b.depth).forEach(item => item.paint());
    const discs = data.joints.map(joint => ({ ...joint, at: onto(origin(frames[joint.moves])) }));
    for (const disc of discs) {
      pen.beginPath(); pen.arc(disc.at[0], disc.at[1], 5.5, 0, 2 * Math.PI);
      pen.fillStyle = css(byShare(disc.share)); pen.strokeStyle = css(colours.paper); pen.lineWidth = 1.5;
      pen.fill(); pen.stroke();
    }
    words(discs, frames, onto, row.at);
    told.textContent = row.told;
    times.textContent = `${(data.factor * longer.value).toLocaleString("en").replace(/,/g, "\u2009")} times larger`;
  };

  const floor = line => {
    const step = radius / 4, colour = css(colours.faint, 1, 0.9);
    for (let k = -4; k <= 4; k++) {
      line([k * step, -4 * step, 0], [k * step, 4 * step, 0], colour, 1, -10 * radius);
      line([-4 * step, k * step, 0], [4 * step, k * step, 0], colour, 1, -10 * radius);
    }
  };

  /* the base: a plate under the root */
  const plate = (onto, items) => {
    const wide = 0.16 * radius, turns = [...Array(48).keys()].map(k => k * Math.PI / 24);
    const points = turns.map(a => onto([wide * Math.cos(a), wide * Math.sin(a), 0]));
    items.push({ depth: -5 * radius, paint: () => {
      pen.fillStyle = css(byShare(data.base.share)); pen.strokeStyle = css(colours.paper); pen.lineWidth = 1.5;
      pen.beginPath(); points.forEach(p => pen.lineTo(p[0], p[1])); pen.closePath(); pen.fill(); pen.stroke();
    } });
  };

  const body = (frames, onto, towards, right, up, items, line) => {
    const light = unit(along(along(towards, up, 0.7), right, -0.5));
    const solid = new Set(data.solids.map(s => s.link));
    data.links.forEach((link, k) => {
      if (k + 1 < frames.length && !solid.has(k))
        line(origin(frames[k]), origin(frames[k + 1]), css(byShare(link.share)), 7);
    });
    for (const shape of data.solids) {
      const corners = [];
      for (let k = 0; k < shape.corners.length; k += 3)
        corners.push(placed(frames[shape.link], shape.corners.slice(k, k + 3)));
      const colour = byShare(data.links[shape.link].share);
      for (let k = 0; k < shape.faces.length; k += 3) {
        const [a, b, c] = [0, 1, 2].map(i => corners[shape.faces[k + i]]);
        const normal = unit(cross(less(b, a), less(c, a)));
        if (dot(normal, towards) <= 0) continue;
        const points = [a, b, c].map(onto);
        const fill = css(colour, 0.72 + 0.36 * Math.max(0, dot(normal, light)));
        items.push({ depth: (points[0][2] + points[1][2] + points[2][2]) / 3, paint: () => {
          pen.fillStyle = pen.strokeStyle = fill; pen.lineWidth = 0.8; pen.lineJoin = "round";
          pen.beginPath(); points.forEach(p => pen.lineTo(p[0], p[1])); pen.closePath(); pen.fill(); pen.stroke();
        } });
      }
    }
  };

  /* the places with the largest shares are named beside them, from top to bottom, none over another */
  const words = (discs, frames, onto, target) => {
    const middle = k => along(origin(frames[k]), less(origin(frames[k + 1]), origin(frames[k])), 0.5);
    const links = data.links.map((link, k) => ({ ...link, k })).filter(link => link.k + 1 < frames.length)
      .map(link => ({ ...link, at: onto(middle(link.k)) }));
    const last = origin(frames[frames.length - 1]);
    const ends = [{ ...data.base, at: onto([0, 0, 0]) }, { ...data.tool, at: onto(along(last, less(target, last), 0.5)) }];
    const named = [...discs, ...links, ...ends].filter(place => place.named)
      .sort((a, b) => b.share - a.share).slice(0, width < 560 ? 3 : 5).sort((a, b) => a.at[1] - b.at[1]);
    pen.font = "12px system-ui, sans-serif"; pen.textBaseline = "middle";
    let next = 12;
    for (const place of named) {
      const wide = pen.measureText(place.named).width, y = Math.max(place.at[1], next);
      const left = place.at[0] > width / 2 ? Math.min(place.at[0] + 34, width - wide - 6) : Math.max(place.at[0] - 34 - wide, 6);
      const near = place.at[0] > width / 2 ? left - 3 : left + wide + 3;
      next = y + 19;
      pen.strokeStyle = css(colours.ink, 1, 0.6); pen.lineWidth = 1;
      pen.beginPath(); pen.moveTo(place.at[0], place.at[1]); pen.lineTo(near, y); pen.stroke();
      pen.fillStyle = css(colours.paper, 1, 0.85); pen.fillRect(left - 3, y - 9, wide + 6, 18);
      pen.fillStyle = css(colours.ink); pen.fillText(place.named, left, y);
    }
  };

  const ask = () => { if (!asked) { asked = true; requestAnimationFrame(draw); } };
  const fit = () => {
    width = canvas.clientWidth; height = canvas.clientHeight;
    const fine = Math.max(window.devicePixelRatio || 1, 2);
    canvas.width = Math.round(width * fine); canvas.height = Math.round(height * fine);
    read(); draw();
  };
  const turn = (dx, dy) => {
    view.yaw -= dx; view.pitch = Math.max(-1.55, Math.min(1.55, view.pitch + dy)); ask();
  };
  const nearer = by => { view.zoom = Math.max(0.5, Math.min(12, view.zoom * by)); ask(); };

  let held = null;
  canvas.addEventListener("pointerdown", event => {
    held = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", event => {
    if (!held) return;
    turn((event.clientX - held[0]) / 150, (event.clientY - held[1]) / 150);
    held = [event.clientX, event.clientY];
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
  canvas.addEventListener("wheel", event => {
    if (!event.ctrlKey && !event.metaKey) return; /* else the page scrolls */
    event.preventDefault(); nearer(Math.exp(-event.deltaY / 300));
  }, { passive: false });
  const keys = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
  canvas.addEventListener("keydown", event => {
    if (keys[event.key]) turn(...keys[event.key]);
    else if (event.key === "+" || event.key === "=") nearer(1.2);
    else if (event.key === "-") nearer(1 / 1.2);
    else return;
    event.preventDefault();
  });
  part("nearer").addEventListener("click", () => nearer(1.25));
  part("farther").addEventListener("click", () => nearer(0.8));
  part("reset").addEventListener("click", () => { Object.assign(view, START); ask(); });
  for (const name of ["row", "longer", "before", "after"]) part(name).addEventListener("input", ask);
  new ResizeObserver(fit).observe(canvas);
  for (const what of ["print", "(prefers-color-scheme: dark)"]) matchMedia(what).addEventListener("change", fit);
  fit();
})();
