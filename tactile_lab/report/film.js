"use strict";
// Plays spikes per taxel and frame: a square each, the stronger the more spikes, which
// fade over some frames. Dead taxels are crossed out, stuck ones framed.
(() => {
  const film = JSON.parse(document.getElementById("film").textContent);
  const LONGEST = 12, LARGEST = 520, AIR = 8, FOOT = 26;
  const raw = Uint8Array.from(atob(film.counts), (c) => c.charCodeAt(0));
  const kinds = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array };
  const counts = new kinds[film.bytes](raw.buffer);
  const n = film.x.length;
  const map = document.getElementById("map"), draw = map.getContext("2d");
  const when = document.getElementById("when"), now = document.getElementById("now");
  const play = document.getElementById("play"), all = document.getElementById("all");
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  const span = (values) => values.reduce(
    ([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity],
  );
  const [left, right] = span(film.x), [bottom, top] = span(film.y);
  const scale = LARGEST / (Math.max(right - left, top - bottom) + film.side);
  const size = Math.max(film.side * scale, 1);
  const dots = Math.max(window.devicePixelRatio, 1);
  const wide = Math.max((right - left + film.side) * scale, 120) + 2 * AIR;
  const high = (top - bottom + film.side) * scale + 2 * AIR + FOOT;
  map.width = Math.round(wide * dots);
  map.height = Math.round(high * dots);
  map.style.width = `${wide}px`;
  const xs = film.x.map((x) => AIR + (x - left) * scale);
  const ys = film.y.map((y) => AIR + (top - y) * scale);
  const ground = document.createElement("canvas"), lay = ground.getContext("2d");
  ground.width = map.width;
  ground.height = map.height;
  lay.setTransform(dots, 0, 0, dots, 0, 0);
  let timer = 0;

  // the length that is written below: 1, 2 or 5 of a power of ten, in mm
  const longest = (wide - 2 * AIR) / 2.5 / scale * 1e3;
  const ten = 10 ** Math.floor(Math.log10(longest));
  const length = ten * [5, 2, 1].find((k) => k * ten <= longest * (1 + 1e-9));

  function lay_ground() {
    lay.clearRect(0, 0, wide, high);
    lay.fillStyle = colour("band");
    for (let i = 0; i < n; i += 1) lay.fillRect(xs[i], ys[i], size, size);
    const line = high - FOOT + 8;
    lay.fillStyle = lay.strokeStyle = colour("quiet");
    lay.lineWidth = 1.5;
    lay.font = "12px system-ui, sans-serif";
    lay.beginPath();
    lay.moveTo(AIR, line);
    lay.lineTo(AIR + length / 1e3 * scale, line);
    lay.stroke();
    lay.fillText(`${Number(length.toPrecision(1))} mm`, AIR, line + 14);
  }

  function marks() {
    const a = size * 0.25, b = size * 0.75;
    draw.globalAlpha = 1;
    draw.lineWidth = Math.max(1, size / 12);
    draw.strokeStyle = colour("quiet");
    draw.beginPath();
    for (const i of film.dead) {
      draw.moveTo(xs[i] + a, ys[i] + a);
      draw.lineTo(xs[i] + b, ys[i] + b);
      draw.moveTo(xs[i] + b, ys[i] + a);
      draw.lineTo(xs[i] + a, ys[i] + b);
    }
    draw.stroke();
    draw.strokeStyle = colour("simulated");
    const half = draw.lineWidth / 2;
    for (const i of film.stuck) {
      draw.strokeRect(xs[i] + half, ys[i] + half, size - 2 * half, size - 2 * half);
    }
  }

  function paint() {
    const frame = Number(when.value);
    const most = all.checked ? film.most_of_all : film.most;
    now.value = `${(film.from + frame * film.step).toFixed(3)} s`;
    draw.setTransform(1, 0, 0, 1, 0, 0);
    draw.globalAlpha = 1;
    draw.clearRect(0, 0, map.width, map.height);
    draw.drawImage(ground, 0, 0);
    draw.setTransform(dots, 0, 0, dots, 0, 0);
    draw.fillStyle = colour("rate");
    const first = all.checked ? 0 : Math.max(0, frame - LONGEST);
    for (let i = 0; i < n; i += 1) {
      let count = 0, weight = 1;
      for (let k = frame; k >= first; k -= 1) {
        count += weight * counts[k * n + i];
        if (!all.checked) weight *= film.fading;
      }
      if (count > 0) {
        draw.globalAlpha = 0.15 + 0.85 * Math.min(count / most, 1);
        draw.fillRect(xs[i], ys[i], size, size);
      }
    }
    marks();
  }

  function dress() {
    lay_ground();
    paint();
  }

  function next() {
    when.value = (Number(when.value) + 1) % film.frames;
    paint();
    timer = setTimeout(next, film.pause);
  }

  play.addEventListener("click", () => {
    play.textContent = timer ? "Play" : "Pause";
    if (timer) {
      clearTimeout(timer);
      timer = 0;
    } else {
      timer = setTimeout(next, film.pause);
    }
  });
  for (const part of [when, all]) part.addEventListener("input", paint);
  for (const seen of ["(prefers-color-scheme: dark)", "print"]) {
    matchMedia(seen).addEventListener("change", dress);
  }
  when.value = film.fullest;
  dress();
})();
