"use strict";
// Plays spikes per taxel and frame: a square each, the stronger the more spikes, which
// fade over some frames.
(() => {
  const film = JSON.parse(document.getElementById("film").textContent);
  const FADING = 0.75, LONGEST = 12;
  const bytes = Uint8Array.from(atob(film.counts), (c) => c.charCodeAt(0));
  const n = film.x.length;
  const at = (frame, taxel) => bytes[frame * n + taxel];
  const map = document.getElementById("map"), draw = map.getContext("2d");
  const when = document.getElementById("when"), now = document.getElementById("now");
  const play = document.getElementById("play"), all = document.getElementById("all");
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  const low = [Math.min(...film.x), Math.min(...film.y)];
  const wide = Math.max(Math.max(...film.x) - low[0], Math.max(...film.y) - low[1]);
  const scale = 500 / (wide + film.side || 1);
  const size = Math.max(film.side * scale, 2);
  let timer = 0;

  function shade(part) {
    draw.globalAlpha = 1;
    draw.fillStyle = colour("band");
    return part <= 0 ? 0 : 0.15 + 0.85 * Math.min(part, 1);
  }

  function paint() {
    const frame = Number(when.value);
    now.value = `${(film.from + frame * film.step).toFixed(3)} s`;
    draw.clearRect(0, 0, map.width, map.height);
    for (let i = 0; i < n; i += 1) {
      const x = 20 + (film.x[i] - low[0] + film.side / 2) * scale;
      const y = 520 - (film.y[i] - low[1] + film.side / 2) * scale;
      let count = 0, weight = 1;
      const first = all.checked ? 0 : Math.max(0, frame - LONGEST);
      for (let k = frame; k >= first; k -= 1) {
        count += weight * at(k, i);
        if (!all.checked) weight *= FADING;
      }
      const strong = shade(count / (all.checked ? film.most_of_all : film.most));
      draw.fillRect(x - size / 2, y - size / 2, size, size);
      if (strong > 0) {
        draw.globalAlpha = strong;
        draw.fillStyle = colour("rate");
        draw.fillRect(x - size / 2, y - size / 2, size, size);
      }
    }
    draw.globalAlpha = 1;
  }

  function stop() {
    clearInterval(timer);
    timer = 0;
    play.textContent = "Play";
  }

  play.addEventListener("click", () => {
    if (timer) return stop();
    play.textContent = "Pause";
    timer = setInterval(() => {
      when.value = (Number(when.value) + 1) % film.frames;
      paint();
    }, 50);
    return undefined;
  });
  for (const part of [when, all]) part.addEventListener("input", paint);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
  when.value = film.fullest;
  paint();
})();
