// The page's script: profiler and contours of the fitted surfaces, settings, values in figures, tables, copying.
// Names and units of the study are set only as text or properties; generated markup contains only numbers.
(() => {
const $ = (query, from = document) => from.querySelector(query);
const all = (query, from = document) => [...from.querySelectorAll(query)];
const make = (tag, properties = {}, ...inside) => {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...inside);
  return node;
};
const button = (text, onclick, more = {}) => make("button", { type: "button", onclick, ...more }, text);
const short = (value, digits = 4) => String(+value.toPrecision(digits)).replace("-", "−");
const span = ends => ends.map(end => short(end)).join(" to ");
const headed = ({ label, unit }) => label + (unit && "," + unit);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// ---- copying, as text or as CSV without cells that a spreadsheet would run as formulas

const copy = async (event, text) => {
  const pressed = event.currentTarget;
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = make("textarea", { value: text });
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  const label = pressed.dataset.label ??= pressed.textContent;
  pressed.textContent = "Copied";
  setTimeout(() => { pressed.textContent = label; }, 1500);
};
const csvCell = cell => {
  let text = String(cell).trim().replace(/^−(?=[\d.])/, "-");
  if (/^[=+\-@\t]/.test(text) && !/^[-+\d.e %*]+$/.test(text)) text = "'" + text;
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};
const csv = rows => rows.map(row => row.map(csvCell).join(",") + "\n").join("");
for (const node of all("[data-copy]")) {
  node.hidden = false;
  node.onclick = event => copy(event, node.dataset.copy);
}

// ---- tables: a click on a heading sorts the rows, a button copies them

const compare = (a, b) => {
  const [x, y] = [a, b].map(text => parseFloat(text.replace("−", "-").replace(/^[^\d.-]+/, "")));
  return isNaN(x) || isNaN(y) ? isNaN(x) - isNaN(y) || a.localeCompare(b) : x - y;
};
const sort = head => {
  const table = head.closest("table"), body = table.tBodies[0], place = head.cellIndex;
  const way = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  all("thead th", table).forEach(other => other.removeAttribute("aria-sort"));
  head.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
  const text = row => row.cells[place].textContent.trim();
  body.append(...[...body.rows].sort((a, b) => way * compare(text(a), text(b))));
};
for (const sheet of all(".sheet")) {
  for (const head of all("thead th", sheet)) {
    head.replaceChildren(button(head.textContent, () => sort(head), { className: "sort" }));
  }
  const texts = () => all("tr", sheet).map(row => [...row.cells].map(cell => cell.textContent));
  $(".scroll", sheet).after(button("Copy as CSV", event => copy(event, csv(texts())), { className: "quiet" }));
}

// ---- figures: the value at the pointer

const tip = make("div", { className: "tip", hidden: true });
document.body.append(tip);
const placeIn = (svg, event) => {
  const box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
  return [(event.clientX - box.left) * view.width / box.width, (event.clientY - box.top) * view.height / box.height];
};
const along = ({ ends, from, to, log }, value) => {
  const scale = log ? Math.log : Number;
  return ends[0] + (ends[1] - ends[0]) * (scale(value) - scale(from)) / (scale(to) - scale(from));
};
const val = ({ name, unit }, value) => name ? `${name} ${short(value)}${unit}` : "";
for (const svg of all("svg[data-read]")) {
  const axes = JSON.parse(svg.dataset.read);
  const points = axes.flatMap(({ x, y, series }) => series.flatMap(([label, values]) => values.map(([a, b]) => (
    { at: [along(x, a), along(y, b)], text: [label, val(x, a), val(y, b)].filter(Boolean).join(", ") }))));
  svg.addEventListener("pointermove", event => {
    const [x, y] = placeIn(svg, event), far = point => Math.hypot(point.at[0] - x, point.at[1] - y);
    const nearest = points.reduce((best, point) => far(point) < far(best) ? point : best, points[0]);
    tip.hidden = far(nearest) > 20;
    tip.textContent = nearest.text;
    tip.style.left = `${Math.min(event.clientX, innerWidth - tip.offsetWidth - 20) + 10 + scrollX}px`;
    tip.style.top = `${event.clientY + scrollY + 16}px`;
  });
  svg.addEventListener("pointerleave", () => { tip.hidden = true; });
}

// ---- the surfaces: φᵀβ, √(φᵀCφ) and their intervals; φ = 1, xᵢ, xᵢxⱼ, xᵢ²

const terms = x => {
  const phi = [1, ...x];
  for (let i = 0; i < x.length; i++) for (let j = i + 1; j < x.length; j++) phi.push(x[i] * x[j]);
  for (const coded of x) phi.push(coded * coded);
  return phi;
};
const product = (a, b) => {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
};
// Coordinates z of a surface over factors and conditions at one condition (see `Place.coordinates` in section.py).
const coordinates = ({ factors, start, rate, exponents, condition }, x) => [...factors.map((j, i) => (
  (start[i] + x[j]) * Math.exp(rate[i] * x[exponents[i]]) - start[i])), condition];
const predict = ({ beta, covariance, own, t, place }, x) => {
  const phi = terms(place ? coordinates(place, x) : x), y = product(phi, beta);
  const of = place?.logarithm ? Math.exp : value => value;
  if (t === null) return { y: of(y), half: 0 };
  const variance = Math.max(0, product(phi, covariance.map(row => product(row, phi))));
  const between = half => [of(y - half), of(y + half)];
  const mean = between(t * Math.sqrt(variance)), run = between(t * Math.sqrt(own + variance));
  return { y: of(y), half: (run[1] - run[0]) / 2, mean, run };
};

// ---- drawing

const mark = (tag, set, inside = "") => `<${tag}${Object.entries(set).map(([name, value]) => (
  ` ${name}="${typeof value === "number" ? +value.toFixed(2) : value}"`)).join("")}>${inside}</${tag}>`;
const path = points => "M" + points.map(point => point.map(at => Math.round(10 * at) / 10).join(" ")).join("L");
const trace = (kind, d) => mark("path", { class: kind, d });
const dot = (kind, cx, cy, r, opacity = 1) => mark("circle", { class: kind, cx, cy, r, opacity });
const write = (x, y, anchor, text) => mark("text", { x, y, "text-anchor": anchor }, text);
const star = (x, y) => mark("text", { class: "star", x, y: y + 5, "text-anchor": "middle" }, "★");
const spread = (low, high, count) => Array.from({ length: count }, (_, i) => low + (high - low) * i / (count - 1));
const ticks = (low, high, most) => {
  const least = (high - low) / most || 1, power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map(n => n * power).find(size => size > least * 0.999999);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
};
// Drawing text takes most of the time, so unchanged text is not drawn again.
const put = (node, text) => { if (node.drawn !== text) node.innerHTML = node.drawn = text; };
const frame = (x, y) => {
  const [left, right, bottom, top] = [...x.ends, ...y.ends];
  const [across, up] = [x, y].map(axis => (
    ticks(axis.from, axis.to, 5).map(value => [along(axis, value), short(value)])));
  return trace("frame", `M${left} ${top}V${bottom}H${right}`) +
    across.map(([at, text]) => write(at, bottom + 16, "middle", text)).join("") +
    up.map(([at, text]) => write(left - 6, at + 4, "end", text)).join("");
};
// Areas where a field is positive, and their borders, interpolated linearly in each cell of the grid.
const positive = (field, x, y) => {
  let area = "", border = "";
  for (let j = 0; j + 1 < y.length; j++) {
    const lower = field[j], upper = field[j + 1];
    const box = (from, to) => [[x[from], y[j]], [x[to], y[j]], [x[to], y[j + 1]], [x[from], y[j + 1]]];
    // All cells of this row from `begin` to i are completely positive.
    for (let i = 0, begin = 0; i + 1 < x.length; i++) {
      const count = (lower[i] > 0) + (lower[i + 1] > 0) + (upper[i + 1] > 0) + (upper[i] > 0), whole = count === 4;
      const end = whole ? i + 1 : i;
      if ((!whole || i + 2 === x.length) && end > begin) area += path(box(begin, end)) + "z";
      if (whole) continue;
      begin = i + 1;
      if (!count) continue;
      const value = [lower[i], lower[i + 1], upper[i + 1], upper[i]], corner = box(i, i + 1), ring = [], cut = [];
      for (let k = 0; k < 4; k++) {
        const next = (k + 1) % 4, share = value[k] / (value[k] - value[next]);
        if (value[k] > 0) ring.push(corner[k]);
        if (value[k] > 0 === value[next] > 0) continue;
        cut.push(corner[k].map((from, axis) => from + share * (corner[next][axis] - from)));
        ring.push(cut.at(-1));
      }
      area += path(ring) + "z";
      for (let k = 0; k < cut.length; k += 2) border += path(cut.slice(k, k + 2));
    }
  }
  return { area, border };
};
const COLOURS = "440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725".split(" ");
const drag = (svg, act) => {
  const move = event => { if (event.buttons) act(...placeIn(svg, event)); };
  svg.addEventListener("pointerdown", event => { svg.setPointerCapture(event.pointerId); move(event); });
  svg.addEventListener("pointermove", move);
};

// ---- the profiler

const allowed = ({ center, half }, level) => Math.abs(level - center) <= 100 * half;
// The settings in the address of the page; values that do not suit this study, or would overflow, are ignored.
const addressed = (address, factors, count) => {
  const query = new URLSearchParams(address), of = query.get("of");
  const levels = text => {
    const values = (text ?? "").split(",").map(part => part.trim() ? Number(part) : NaN);
    return values.length === factors.length && values.every((level, i) => allowed(factors[i], level)) && values;
  };
  const keep = query.getAll("keep").slice(0, 100).map(text => [
    text.replace(/^[^|]*\|/, "").slice(0, 100), levels(text.split("|")[0])]);
  return { at: levels(query.get("at")), of: /^\d{1,3}$/.test(of) && of < count ? +of : null,
    keep: keep.filter(([, values]) => values) };
};

const profiler = (home, { factors, surfaces, radius, called, holds, first, kept, against }) => {
  const calibrated = factors.map(factor => factor.at);
  const part = query => $(query, home);
  const code = levels => levels.map((level, i) => (level - factors[i].center) / factors[i].half);
  const level = (i, coded) => factors[i].center + factors[i].half * coded;
  let at = [...calibrated], seen = first, pair = [0, 1], due = false, drawn = "", aim = null;
  const change = () => {
    if (!due) requestAnimationFrame(() => { due = false; show(); });
    due = true;
  };
  const set = (i, value) => { at[i] = value; change(); };
  const axisOf = (i, ends) => ({ ends, from: factors[i].ends[0], to: factors[i].ends[1] });
  const inside = (axis, value) => along(axis, clamp(value, axis.from, axis.to));
  const levelAt = ({ ends: [a, b], from, to }, place) => clamp(from + (place - a) / (b - a) * (to - from), from, to);
  const squares = (x, but, from = []) => (
    x.reduce((sum, coded, j) => sum + (but.includes(j) ? 0 : (coded - (from[j] ?? 0)) ** 2), 0));
  // Opacity of a run: exp(−d²), with d the coded distance of its other factors from the setting.
  const near = (run, x, but) => Math.max(0.08, Math.exp(-squares(x, but, run)));
  // Largest coded distance of some factors from the centre, given the others x: √(radius² − Σx²).
  const reach = (x, but) => Math.sqrt(Math.max(0, radius ** 2 - squares(x, but)));

  const cards = surfaces.map((surface, i) => {
    const choice = make("input", { type: "radio", name: "seen", onchange: () => { seen = i; change(); } });
    const texts = ["strong", "span", "span"].map(tag => make(tag));
    part(".cards").append(make("label", {}, choice, surface.label, make("br"), ...texts));
    return { choice, texts };
  });
  const panels = factors.map((factor, i) => {
    const axis = axisOf(i, [44, 272]), [min, max] = factor.ends, step = (max - min) / 200;
    const typed = make("input", { type: "number", step: "any" });
    const slider = make("input", { type: "range", min, max, step, ariaLabel: headed(factor) });
    typed.oninput = () => allowed(factor, typed.valueAsNumber) && set(i, typed.valueAsNumber);
    slider.oninput = () => set(i, slider.valueAsNumber);
    const box = make("div", { innerHTML: '<svg viewBox="0 0 280 200" aria-hidden="true"><g></g><g></g></svg>' });
    const svg = box.firstChild;
    drag(svg, place => set(i, levelAt(axis, place)));
    box.prepend(make("label", {}, headed(factor) + " ", typed));
    box.append(slider);
    part(".panels").append(box);
    return { axis, typed, slider, svg };
  });
  // Range of the axis of a response: runs, measured value, and the curves through the calibrated point.
  const spans = surfaces.map(surface => {
    const { measured, sd, runs } = surface, ends = factors.flatMap((factor, i) => (
      factor.ends.map(end => predict(surface, code(calibrated.with(i, end))).y)));
    const all = [...ends, ...runs.map(run => run.at(-1)), measured - sd, measured + sd];
    const low = Math.min(...all), high = Math.max(...all), room = 0.06 * (high - low) || 1;
    return [low - room, high + room];
  });
  const drawPanel = (i, x) => {
    const surface = surfaces[seen], { axis, svg } = panels[i], [left, right] = axis.ends;
    const y = { ends: [172, 8], from: spans[seen][0], to: spans[seen][1] };
    const levels = spread(axis.from, axis.to, 41), px = levels.map(value => along(axis, value));
    const curve = levels.map(value => predict(surface, x.with(i, code(at.with(i, value))[i])));
    const line = value => curve.map((point, k) => [px[k], inside(y, value(point))]);
    const band = kind => trace(kind,
      path([...line(p => p[kind][1]), ...line(p => p[kind][0]).reverse()]));
    const far = reach(x, [i]), { low, high } = factors[i], { measured, sd } = surface, top = inside(y, measured + sd);
    const limits = [Math.max(level(i, -far), low), Math.min(level(i, far), high)];
    const [from, to] = limits.map(value => inside(axis, value)), here = inside(axis, at[i]);
    put(svg.children[0], frame(axis, y));
    svg.children[1].innerHTML = [[left, from], [to, right]].map(([a, b]) => (
      mark("rect", { class: "off", x: a, y: 8, width: Math.max(0, b - a), height: 164 }))).join("") +
      mark("rect", { class: "sd", x: left, y: top, width: right - left, height: inside(y, measured - sd) - top }) +
      (surface.t === null ? "" : band("run") + band("mean")) +
      trace("measured", `M${left} ${along(y, measured)}H${right}`) +
      surface.runs.map(run => (
        dot("dot", inside(axis, level(i, run[i])), along(y, run.at(-1)), 3, near(run, x, [i])))).join("") +
      trace("curve", path(line(p => p.y))) + trace("now", `M${here} 8V172`) +
      star(inside(axis, calibrated[i]), inside(y, predict(surface, code(calibrated)).y)) +
      kept.map(([, one]) => dot("dot", inside(axis, one[i]), inside(y, predict(surface, code(one)).y), 5)).join("") +
      dot("now", here, inside(y, predict(surface, x).y), 4.5);
  };

  // ---- contours of two factors

  const map = part(".map svg"), choices = all(".map select", home), goal = part(".aim");
  const axes = () => [axisOf(pair[0], [56, 440]), axisOf(pair[1], [290, 10])];
  const drawBase = x => {
    const surface = surfaces[seen], [across, up] = axes(), [a, b] = pair, target = aim ?? surface.measured;
    const [cols, rows] = [across, up].map(axis => spread(axis.from, axis.to, 25));
    const grid = rows.map(row => cols.map(col => predict(surface, code(at.with(a, col).with(b, row)))));
    const px = cols.map(value => along(across, value)), py = rows.map(value => along(up, value));
    const where = value => positive(grid.map(row => row.map(value)), px, py);
    const heights = grid.flat().map(p => p.y), low = Math.min(...heights), high = Math.max(...heights);
    const inner = ticks(low, high, 9), bar = { ends: [290, 10], from: low, to: high }, limits = [low, ...inner, high];
    const fill = (k, d) => {
      const colour = "#" + COLOURS[Math.round(10 * k / (inner.length || 1))];
      return mark("path", { fill: colour, stroke: colour, "stroke-width": 0.6, d });
    };
    const areas = ["M56 10H440V290H56z", ...inner.map(value => where(p => p.y - value).area)];
    const error = aim === null ? surface.error : 0, far = reach(x, pair);
    const band = [1, -1].map(side => where(p => p.y - target + side * Math.hypot(p.half, error)).area).join("");
    const size = (i, axis) => Math.abs(along(axis, level(i, far)) - along(axis, level(i, 0)));
    const step = limits.map(value => along(bar, value));
    return areas.map((area, k) => fill(k, area) + fill(k, `M462 ${step[k]}V${step[k + 1]}h14V${step[k]}z`)).join("") +
      inner.map(value => write(482, along(bar, value) + 4, "start", short(value))).join("") +
      (holds ? mark("path", { class: "band", "fill-rule": "evenodd", d: band }) : "") +
      trace("target", where(p => p.y - target).border) +
      mark("svg", { x: 56, y: 10, width: 384, height: 280, viewBox: "56 10 384 280" }, mark("ellipse", { class: "reach",
        cx: along(across, level(a, 0)), cy: along(up, level(b, 0)), rx: size(a, across), ry: size(b, up) })) +
      surface.runs.map(run => dot("spot", inside(across, level(a, run[a])), inside(up, level(b, run[b])), 3.5,
        near(run, x, pair))).join("") +
      kept.map(([, one]) => dot("spot", inside(across, one[a]), inside(up, one[b]), 5)).join("") +
      star(inside(across, calibrated[a]), inside(up, calibrated[b]));
  };
  const drawMap = x => {
    const key = JSON.stringify([seen, pair, aim, kept, at.filter((_, i) => !pair.includes(i))]);
    if (key !== drawn) map.children[0].innerHTML = drawBase(x);
    drawn = key;
    put(map.children[2], frame(...axes()));
    pair.forEach((i, way) => {
      map.children[3 + way].textContent = headed(factors[i]);
      choices[way].value = i;
    });
    const [here, there] = axes().map((axis, way) => inside(axis, at[pair[way]]));
    map.children[1].innerHTML = trace("cross", `M${here} 10V290M56 ${there}H440`) +
      dot("now", here, there, 5);
  };
  if (map) {
    choices.forEach((select, way) => {
      select.append(...factors.map((factor, i) => new Option(factor.label, i)));
      select.onchange = () => {
        if (pair[1 - way] === +select.value) pair[1 - way] = pair[way];
        pair[way] = +select.value;
        change();
      };
    });
    goal.oninput = () => { aim = isFinite(goal.valueAsNumber) ? goal.valueAsNumber : null; change(); };
    drag(map, (...place) => axes().forEach((axis, way) => set(pair[way], levelAt(axis, place[way]))));
  }

  // ---- settings

  const table = part(".kept table"), name = part(".name"), link = part(".link");
  const cells = levels => [...levels.map(value => short(value, 6)), ...surfaces.map(surface => {
    const { y, run } = predict(surface, code(levels));
    return short(y) + (run ? ` (${span(run)})` : "");
  })];
  const settings = () => [["Current", at], [called, calibrated], ...kept];
  const list = () => table.tBodies[0].replaceChildren(...settings().map(([label, levels], i) => {
    const last = make("td"), row = make("tr", {}, make("th", { scope: "row" }, label));
    row.append(...cells(levels).map(text => make("td", { className: "n" }, text)), last);
    if (i) last.append(button(i > 1 ? "Show" : "Back", () => { at = [...levels]; change(); }));
    if (i > 1) last.append(button("Remove", () => { kept.splice(i - 2, 1); list(); change(); }));
    return row;
  }));
  const heads = ["Setting", ...[...factors, ...surfaces].map(headed)];
  $("tr", table).append(...heads.map(text => make("th", { scope: "col" }, text)), make("td"));
  part(".store").onclick = () => {
    kept.push([name.value || `Setting ${kept.length + 1}`, [...at]]);
    name.value = "";
    list();
    change();
  };
  part(".csv").onclick = event => copy(event, csv([
    ["setting", ...factors.map(factor => factor.name),
      ...surfaces.flatMap(({ label }) => [label, `${label}, low`, `${label}, high`])],
    ...settings().map(([label, levels]) => [label, ...levels, ...surfaces.flatMap(surface => {
      const { y, run } = predict(surface, code(levels));
      return [y, ...(run ?? ["", ""])];
    })]),
  ]));
  part(".yaml").onclick = event => {
    const levels = factors.map((factor, i) => [factor.name, +at[i].toPrecision(6)]), { simulate } = surfaces[seen];
    const command = simulate && `# ${simulate}${levels.map(([key, value]) => ` --set ${key}=${value}`).join("")}\n`;
    copy(event, command + levels.map(([key, value]) => `${key}: ${value}\n`).join(""));
  };
  const read = () => {
    const setting = addressed(location.hash.slice(1), factors, surfaces.length);
    if (setting.at) [at, seen, kept] = [setting.at, setting.of ?? seen, setting.keep];
    list();
    change();
  };

  const show = () => {
    const x = code(at), far = Math.sqrt(squares(x, []));
    surfaces.forEach((surface, i) => {
      const { y, mean, run } = predict(surface, x), { choice, texts } = cards[i], { measured, sd, unit } = surface;
      const [whole, one] = run ? [span(mean), span(run)] : [];
      choice.checked = i === seen;
      texts[0].textContent = short(y) + unit;
      texts[1].textContent = !run ? "Saturated fit: no interval"
        : `95 %: ${whole}${one === whole ? "" : ` (mean), ${one} (one run)`}`;
      const off = 100 - 100 * y / measured;
      texts[2].textContent = `${against[0]} ${short(measured)}${sd ? ` ± ${short(sd, 3)}` : ""}${unit}: ${
        Math.abs(off).toFixed(1)} % ${against[off > 0 ? 1 : 2]}`;
    });
    const said = factors.flatMap(({ label, unit, half, low, high }, i) => (
      at[i] < low - 1e-6 * half || at[i] > high + 1e-6 * half
        ? [`${label} ${short(at[i])}${unit} is outside its range (${span([low, high])}${unit}).`] : []));
    if (far > radius + 1e-6) {
      said.push(`The setting is ${short(far, 3)} coded units from the centre; the runs extend to ${short(radius, 3)}.`);
    }
    part(".outside").textContent = said.length ? `Extrapolated: ${said.join(" ")}` : "";
    panels.forEach(({ typed, slider }, i) => {
      if (typed.valueAsNumber !== at[i]) typed.value = +at[i].toPrecision(6);
      slider.value = at[i];
      drawPanel(i, x);
    });
    if (map) drawMap(x);
    cells(at).forEach((text, i) => { table.tBodies[0].rows[0].cells[i + 1].textContent = text; });
    const keep = kept.map(([label, levels]) => ["keep", `${levels}|${label}`]);
    link.href = `#${new URLSearchParams([["at", at], ["of", seen], ...keep])}`;
  };
  addEventListener("hashchange", read);
  for (const node of all("[data-live]")) node.hidden = false;
  read();
  return levels => surfaces.map(surface => predict(surface, code(levels)));
};
const home = $(".live");
if (home) window.predict = profiler(home, JSON.parse($("script[type]", home).textContent));

// ---- terms of the glossary, explained on hover: each once in a heading, cell, paragraph or caption

const plain = text => text.trim().toLowerCase().replaceAll("_", " ");
const explain = (block, meanings, pattern) => {
  const whole = meanings[plain(block.textContent)], seen = new Set();
  if (whole) return void (block.title = whole);
  const walker = document.createTreeWalker(block, NodeFilter.SHOW_TEXT), nodes = [];
  while (walker.nextNode()) nodes.push(walker.currentNode);
  for (const node of nodes) {
    if (node.parentElement.closest("abbr, button, code, script, style, svg")) continue;
    const parts = node.data.split(pattern).map((part, i) => {
      const name = plain(part), meaning = meanings[name] ?? meanings[name.replace(/s$/, "")];
      if (i % 2 === 0 || !meaning || seen.has(meaning)) return part;
      seen.add(meaning);
      return make("abbr", { title: meaning }, part);
    });
    if (parts.length > 1) node.replaceWith(...parts);
  }
};
const glossary = $("#glossary");
if (glossary) {
  const meanings = JSON.parse(glossary.textContent);
  const long = Object.keys(meanings).filter(name => name.length > 3 || /\W/.test(name)).sort((a, b) => b.length - a.length);
  const names = long.map(name => name.replace(/[^\p{L}\p{N}]/gu, c => c === " " ? "[ _]" : `\\u{${c.codePointAt(0).toString(16)}}`));
  const pattern = new RegExp(`(?<![\\p{L}\\p{N}_-])((?:${names.join("|")})s?)(?![\\p{L}\\p{N}_])`, "giu");
  for (const block of all("h2, h3, th, dt, p, li, summary, figcaption", $("main"))) explain(block, meanings, pattern);
}
})();
