// Sliders over computed states: pressure, shear, stick and slip, and the deformed mesh. Plain SVG, no libraries.
(function () {
  const data = JSON.parse(document.getElementById("load-and-friction-data").textContent);
  const root = document.getElementById("load-and-friction");
  const steps = data.paths[0].P.length, mus = data.mus.length;
  root.innerHTML = `
    <style>
      #load-and-friction { font-size: 0.9em; }
      #load-and-friction .controls { display: grid; grid-template-columns: max-content 1fr max-content; gap: 0.3em 0.8em; align-items: center; }
      #load-and-friction svg { width: 100%; height: auto; color: inherit; }
      #load-and-friction svg text { fill: currentColor; font-size: 12px; }
      #load-and-friction input[type=range] { width: 100%; }
    </style>
    <div class="controls">
      <label for="lf-path">load path</label>
      <select id="lf-path">${data.paths.map((p, i) => `<option value="${i}">${p.name}</option>`).join("")}</select><span></span>
      <label for="lf-step">load</label>
      <input id="lf-step" type="range" min="1" max="${steps}" value="${steps}"><output id="lf-load"></output>
      <label for="lf-mu">friction coefficient</label>
      <input id="lf-mu" type="range" min="0" max="${mus - 1}" value="${mus - 2}"><output id="lf-mu-value"></output>
    </div>
    <svg id="lf-lines" viewBox="0 0 720 330" role="img"></svg>
    <svg id="lf-mesh" viewBox="0 0 720 300" role="img"></svg>
    <p id="lf-words" aria-live="polite"></p>`;
  const find = (id) => document.getElementById(id);
  const path = (points) => points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)},${y.toFixed(1)}`).join("");
  const line = (points, extra) => `<path d="${path(points)}" fill="none" stroke="currentColor" ${extra}/>`;
  const text = (x, y, words, extra = "") => `<text x="${x}" y="${y}" ${extra}>${words}</text>`;
  const top = Math.max(...data.states.flatMap((s) => s.p)) * 1.05, low = -0.55 * top;
  const X = (x) => 60 + ((x + 1.5) / 3) * 640, Y = (p) => 15 + ((top - p) / (top - low)) * 250;
  const inside = data.x.map((x, i) => i).filter((i) => Math.abs(data.x[i]) <= 1.5);

  function lines(state, mu) {
    const curve = (values) => inside.map((i) => [X(data.x[i]), Y(values[i])]);
    let svg = `<defs><pattern id="lf-hatch" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
      <line x1="0" y1="0" x2="0" y2="6" stroke="currentColor" stroke-width="2"/></pattern></defs>`;
    svg += line([[X(-1.5), Y(0)], [X(1.5), Y(0)]], 'stroke-width="0.7"');
    for (let p = Math.ceil(low / 2000) * 2000; p < top; p += 2000)
      svg += line([[56, Y(p)], [60, Y(p)]], "") + text(52, Y(p) + 4, p, 'text-anchor="end"');
    for (let x = -1.5; x <= 1.5; x += 0.5)
      svg += line([[X(x), 265], [X(x), 269]], "") + text(X(x), 318, x.toFixed(1), 'text-anchor="middle"');
    svg += line([[60, 15], [60, 265], [700, 265]], "") + text(14, 140, "MPa", 'transform="rotate(-90 14 140)"') + text(640, 328, "x (mm)");
    svg += line(curve(state.p), 'stroke-width="2.5"') + line(curve(state.p.map((p) => mu * p)), 'stroke-dasharray="6 4"');
    svg += line(curve(state.p.map((p) => -mu * p)), 'stroke-dasharray="6 4"') + line(curve(state.tau), 'stroke-width="1.5" class="tau"');
    svg += inside.map((i) => `<circle cx="${X(data.x[i])}" cy="${Y(state.tau[i])}" r="2.6" fill="currentColor"/>`).join("");
    inside.forEach((i) => {
      const left = X((data.x[Math.max(i - 1, 0)] + data.x[i]) / 2), right = X((data.x[Math.min(i + 1, data.x.length - 1)] + data.x[i]) / 2);
      const fill = ["none", "url(#lf-hatch)", "currentColor"][state.status[i]];
      svg += `<rect x="${left}" y="274" width="${right - left}" height="16" fill="${fill}" stroke="currentColor" stroke-width="0.4"/>`;
    });
    svg += text(52, 287, "zones", 'text-anchor="end"');
    [["pressure p", 'stroke-width="2.5"'], ["&#177; mu p", 'stroke-dasharray="6 4"'], ["shear, a dot a node", 'stroke-width="1.5"']]
      .forEach(([words, style], i) => { svg += line([[72, 26 + 17 * i], [100, 26 + 17 * i]], style) + text(106, 30 + 17 * i, words); });
    [["sticks", "currentColor"], ["slips", "url(#lf-hatch)"], ["free", "none"]].forEach(([words, fill], i) => {
      svg += `<rect x="600" y="${20 + 18 * i}" width="26" height="11" fill="${fill}" stroke="currentColor" stroke-width="0.6"/>` + text(632, 30 + 18 * i, words); });
    return svg;
  }

  function mesh(state) {
    const at = (i) => [X(state.mesh[2 * i]), 255 - (state.mesh[2 * i + 1] / 3) * 640];
    let svg = data.sides.map(([a, b]) => line([at(a), at(b)], 'stroke-width="0.6"')).join("");
    svg += `<rect x="0" y="255" width="720" height="40" fill="currentColor" opacity="0.25"/>` + line([[0, 255], [720, 255]], 'stroke-width="2"');
    return svg + text(360, 280, "road", 'text-anchor="middle"') + text(8, 16, "deformed mesh, not magnified");
  }

  function draw() {
    const k = +find("lf-path").value, step = +find("lf-step").value - 1, m = +find("lf-mu").value, mu = data.mus[m];
    const state = data.states[(k * mus + m) * steps + step], chosen = data.paths[k];
    const P = chosen.P[step], Q = mu * chosen.Q[step];
    find("lf-load").textContent = `P = ${P.toFixed(1)}, Q = ${Q.toFixed(2)} kN/mm`;
    find("lf-mu-value").textContent = mu.toFixed(1);
    find("lf-lines").innerHTML = lines(state, mu);
    find("lf-mesh").innerHTML = mesh(state);
    const zone = (least) => data.x.filter((x, i) => state.status[i] >= least);
    const say = (xs) => xs.length ? `from ${Math.min(...xs).toFixed(2)} to ${Math.max(...xs).toFixed(2)} mm` : "nowhere";
    const words = `Largest pressure ${Math.max(...state.p).toFixed(0)} MPa, largest shear ${Math.max(...state.tau.map(Math.abs)).toFixed(0)} MPa. ` +
      `In contact ${say(zone(1))}; sticks ${say(zone(2))}.`;
    find("lf-words").textContent = words;
    find("lf-lines").setAttribute("aria-label", `Pressure and shear along the road: ${words}`);
    find("lf-mesh").setAttribute("aria-label", "The deformed mesh near the road.");
  }
  ["lf-path", "lf-step", "lf-mu"].forEach((id) => find(id).addEventListener("input", draw));
  draw();
})();
