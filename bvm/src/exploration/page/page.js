"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const at = (id) => document.getElementById(id);
const COLOURS = ["#c4323c", "#2c66b0", "#de921e", "#268a70", "#8454a0", "#60686e"];
const SEQUENTIAL = [[42, 14, 78], [62, 62, 138], [40, 110, 146], [36, 156, 134], [128, 202, 88], [250, 232, 70]];

/** The colour of a number in [0, 1]. */
function colour(value) {
    const place = Math.min(Math.max(value, 0), 1) * (SEQUENTIAL.length - 1);
    const low = Math.min(Math.floor(place), SEQUENTIAL.length - 2), share = place - low;
    return SEQUENTIAL[low].map((part, i) => Math.round(part + share * (SEQUENTIAL[low + 1][i] - part)));
}

/** The bytes of a text in base64. */
function bytes(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function table(id, head, rows) {
    const own = at(id);
    for (const [tag, cells] of [["th", head], ...rows.map((row) => ["td", row])]) {
        const row = own.insertRow();
        for (const cell of cells) {
            const made = document.createElement(tag);
            made.textContent = cell;
            row.append(made);
        }
    }
}

/** Round values between two numbers. */
function ticks(low, high) {
    const coarse = (high - low) / 4.5, power = 10 ** Math.floor(Math.log10(coarse));
    const step = ([5, 2].find((round) => round * power <= coarse) ?? 1) * power;
    const all = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) all.push(+(i * step).toPrecision(6));
    return all;
}

/** Axes with names; returns the pixel of a pair of coordinates. */
function axes(canvas, across, upwards, names, margins = [70, 20, 20, 46]) {
    const g = canvas.getContext("2d"), [left, top, right, bottom] = margins;
    const [w, h] = [canvas.width - left - right, canvas.height - top - bottom];
    const x = (value) => left + (value - across[0]) / (across[1] - across[0]) * w;
    const y = (value) => top + (upwards[1] - value) / (upwards[1] - upwards[0]) * h;
    g.clearRect(0, 0, canvas.width, canvas.height);
    g.font = "13px DejaVu Sans, sans-serif";
    g.strokeStyle = "#e1e4e9";
    g.fillStyle = "#222831";
    for (const value of ticks(Math.min(...upwards), Math.max(...upwards))) {
        g.beginPath(); g.moveTo(left, y(value)); g.lineTo(left + w, y(value)); g.stroke();
        g.textAlign = "right"; g.fillText(String(value), left - 8, y(value) + 4);
    }
    for (const value of ticks(Math.min(...across), Math.max(...across)).filter((value) => !names[0].startsWith("look") || value % 1 === 0)) {
        g.textAlign = "center"; g.fillText(String(value), x(value), top + h + 18);
    }
    g.fillText(names[0], left + w / 2, top + h + 38);
    g.save(); g.translate(16, top + h / 2); g.rotate(-Math.PI / 2); g.fillText(names[1], 0, 0); g.restore();
    g.strokeStyle = "#222831"; g.strokeRect(left, top, w, h);
    return { g, x, y };
}

function legend(g, names, left, top) {
    names.forEach((name, i) => {
        g.fillStyle = COLOURS[i % COLOURS.length]; g.fillRect(left, top + 20 * i - 8, 22, 4);
        g.fillStyle = "#222831"; g.textAlign = "left"; g.fillText(name, left + 30, top + 20 * i);
    });
}

function curves() {
    const quantity = document.querySelector("input[name=quantity]:checked").value;
    const lines = data.policies.map((one) => one[quantity]);
    const low = Math.min(...lines.flat());
    const looks = Math.max(...lines.map((line) => line.length)) - 1;
    const { g, x, y } = axes(at("curves"), [0, looks], [Math.max(0, low - 3), 103], ["looks", "% of the entropy before the first look"]);
    lines.forEach((line, i) => {
        g.strokeStyle = COLOURS[i % COLOURS.length]; g.lineWidth = 2.5; g.beginPath();
        line.forEach((value, look) => (look ? g.lineTo(x(look), y(value)) : g.moveTo(x(look), y(value))));
        g.stroke();
    });
    g.lineWidth = 1;
    legend(g, data.policies.map((one) => one.name), 830, 44);
}

// The cloud: x ahead, y to the left, z up, in metres.
const numbers = new Float32Array(bytes(data.points.data).buffer);
const view = { yaw: 0.6, pitch: 0.75, zoom: 62 };
function cloud() {
    const canvas = at("cloud"), g = canvas.getContext("2d");
    const [sy, cy, sp, cp] = [Math.sin(view.yaw), Math.cos(view.yaw), Math.sin(view.pitch), Math.cos(view.pitch)];
    const project = (px, py, pz) => {
        // The eye looks along the horizontal direction `yaw`, down by `pitch`.
        const ahead = cy * px + sy * py, right = sy * px - cy * py;
        return [canvas.width / 2 + right * view.zoom, canvas.height / 2 - (cp * pz + sp * ahead) * view.zoom, sp * pz - cp * ahead];
    };
    g.fillStyle = "#f7f8fa"; g.fillRect(0, 0, canvas.width, canvas.height);
    const drawn = [], [low, high] = data.points.heights;
    const cut = low + (high - low) * at("cut").value / 100;
    at("height").textContent = `${cut.toFixed(2)} m`;
    for (let i = 0; i < numbers.length; i += 8) {
        const [px, py, pz, p, size] = numbers.subarray(i, i + 5);
        if (pz > cut + 1e-6) continue;
        const [u, v, depth] = project(px, py, pz);
        drawn.push([depth, u, v, size * view.zoom, p, pz, i]);
    }
    drawn.sort((a, b) => a[0] - b[0]);
    for (const [depth, u, v, size, p, pz, i] of drawn) {
        const shade = 0.62 + 0.38 * Math.min(Math.max((depth + 5) / 10, 0), 1);
        const [r, gg, b] = colour((pz - low) / (high - low)).map((part) => Math.round(part * shade));
        g.fillStyle = `rgba(${r},${gg},${b},${Math.min(1, 0.25 + 1.2 * (p - 0.4))})`;
        g.fillRect(u - size / 2, v - size / 2, Math.max(size, 1.5), Math.max(size, 1.5));
        const [vx, vy, vz] = numbers.subarray(i + 5, i + 8);
        if (Math.hypot(vx, vy, vz) > 0.2) {
            const [px, py, pz2] = numbers.subarray(i, i + 3), [eu, ev] = project(px + vx, py + vy, pz2 + vz);
            g.strokeStyle = "#d62839"; g.beginPath(); g.moveTo(u, v); g.lineTo(eu, ev); g.stroke();
        }
    }
    for (const [name, end] of [["x ahead, 1 m", [1, 0, 0]], ["y left", [0, 1, 0]], ["z up", [0, 0, 1]]]) {
        const [u, v] = project(0, 0, 0), [eu, ev] = project(...end);
        g.strokeStyle = g.fillStyle = "#222831"; g.lineWidth = 2; g.beginPath(); g.moveTo(u, v); g.lineTo(eu, ev); g.stroke();
        g.font = "12px DejaVu Sans, sans-serif"; g.textAlign = "left"; g.fillText(name, eu + 4, ev);
    }
    g.lineWidth = 1;
    const head = [[0.3, 0, 0], [-0.1, 0.15, 0], [-0.1, -0.15, 0]].map((corner) => project(...corner));
    g.fillStyle = "#d62839"; g.beginPath(); head.forEach(([u, v], i) => (i ? g.lineTo(u, v) : g.moveTo(u, v))); g.fill();
    bar(g, 20, 40, 300, data.points.heights, "height of a cell (m)");
    g.fillStyle = "#222831"; g.textAlign = "left"; g.fillText(`${drawn.length} of ${numbers.length / 8} occupied cells; fainter: less probable`, 20, 24);
}

/** A colour bar. */
function bar(g, left, top, length, limits, name) {
    for (let i = 0; i < length; i++) {
        g.fillStyle = `rgb(${colour(i / (length - 1))})`; g.fillRect(left + i, top, 1, 12);
    }
    g.fillStyle = "#222831"; g.font = "12px DejaVu Sans, sans-serif";
    g.textAlign = "left"; g.fillText(limits[0].toFixed(1), left, top + 26);
    g.textAlign = "right"; g.fillText(limits[1].toFixed(1), left + length, top + 26);
    g.textAlign = "center"; g.fillText(name, left + length / 2, top + 26, length - 60);
}

const frames = data.panoramas.frames.map(bytes);
function panorama() {
    const which = +at("when").value, number = data.panoramas.looks[which], { rows, columns } = data;
    const { g, x, y } = axes(at("panorama"), [180, -180], [-90, 90], ["azimuth (°), positive to the left", "elevation (°)"], [70, 20, 20, 84]);
    const frame = frames[which];
    const [w, h] = [Math.abs(x(0) - x(360 / columns)) + 0.6, Math.abs(y(0) - y(180 / rows)) + 0.6];
    for (let row = 0; row < rows; row++) {
        for (let column = 0; column < columns; column++) {
            const value = frame[row * columns + column];
            g.fillStyle = value === 255 ? "#d6dce6" : `rgb(${colour(1 - value / 254)})`;
            g.fillRect(x(-180 + (column + 1) * 360 / columns), y(-90 + (row + 1) * 180 / rows), w, h);
        }
    }
    const path = data.looks.filter((look) => look.number <= number).map((look) => look.gaze);
    const degrees = (angle) => angle * 180 / Math.PI;
    path.forEach((gaze, i) => {
        const [u, v] = [x(degrees(gaze.azimuth)), y(degrees(gaze.elevation))], last = i === path.length - 1;
        if (i && Math.abs(gaze.azimuth - path[i - 1].azimuth) < Math.PI) {
            g.strokeStyle = "rgba(255,255,255,.6)"; g.beginPath();
            g.moveTo(x(degrees(path[i - 1].azimuth)), y(degrees(path[i - 1].elevation))); g.lineTo(u, v); g.stroke();
        }
        g.fillStyle = last ? "#d62839" : "#ffffff"; g.strokeStyle = "#222831"; g.beginPath();
        g.arc(u, v, last ? 8 : 3.5, 0, 7); g.fill(); g.stroke();
    });
    const limits = data.panoramas.range_m;
    bar(g, 70, 520, 320, [limits[1], limits[0]], "range of the first occupied cell (m, log)");
    g.textAlign = "left";
    g.fillStyle = "#d6dce6"; g.fillRect(420, 520, 14, 12); g.fillStyle = "#222831"; g.fillText("none", 440, 531);
    g.fillStyle = "#d62839"; g.beginPath(); g.arc(520, 526, 7, 0, 7); g.fill();
    g.fillStyle = "#222831"; g.fillText("gaze of this look", 534, 531);
    g.beginPath(); g.arc(680, 526, 3.5, 0, 7); g.stroke(); g.fillText("earlier gazes", 692, 531);
    at("now").textContent = `look ${number}, ${data.looks[number - 1].time_s.toFixed(1)} s`;
}

function senses() {
    const names = data.looks[0].senses.map((one) => one.sense);
    const of = (name, part) => data.looks.map((look) => look.senses.find((one) => one.sense === name)?.[part] ?? 0);
    const sum = (values) => values.reduce((a, b) => a + b, 0);
    table("senses", ["sense", "looks with readings", "readings", "information (nats)", "faults"], names.map((name) => [
        name, of(name, "readings").filter((n) => n > 0).length, sum(of(name, "readings")), sum(of(name, "information")).toFixed(1),
        data.looks.filter((look) => look.senses.some((one) => one.sense === name && one.fault)).length,
    ]));
    const most = Math.max(1e-9, ...names.flatMap((name) => of(name, "information")));
    const { g, x, y } = axes(at("information"), [0.5, data.looks.length + 0.5], [0, 1.05 * most], ["look", "information (nats)"]);
    names.forEach((name, i) => {
        g.fillStyle = COLOURS[i % COLOURS.length];
        of(name, "information").forEach((value, look) => {
            const width = (x(2) - x(1)) * 0.8 / names.length;
            g.fillRect(x(look + 1) - (x(2) - x(1)) * 0.4 + i * width, y(value), width, y(0) - y(value));
        });
    });
    legend(g, names, 880, 44);
    const stages = [...names.map((name) => [`sense: ${name}`, of(name, "ms")]),
        ["map: prediction and estimation", data.looks.map((look) => look.stages_ms.estimate)],
        ["gaze", data.looks.map((look) => look.stages_ms.gaze)],
        ["turn (simulation)", data.looks.map((look) => look.stages_ms.turn)]];
    const total = sum(stages.flatMap((stage) => stage[1]));
    table("times", ["stage", "mean ms a look", "longest ms", "share"], stages.map(([name, values]) => [
        name, (sum(values) / values.length).toFixed(2), Math.max(...values).toFixed(2), `${(100 * sum(values) / total).toFixed(1)} %`,
    ]));
}

document.title = at("title").textContent = data.title;
at("about").textContent = data.about;
at("omitted").textContent = data.panoramas.omitted;
at("files").textContent = data.files;
table("figures", ["policy", "last H", "mean H", "log-loss", "false", "found", "precision"], data.policies.map((one) => [
    one.name, `${one.entropy.at(-1).toFixed(1)} %`, `${one.mean.toFixed(1)} %`, one.score.log_loss.toFixed(4), one.score.false_occupied,
    `${(100 * one.score.found).toFixed(1)} %`, one.score.precision.toFixed(3),
]));
document.querySelectorAll("input[name=quantity]").forEach((input) => input.addEventListener("change", curves));
at("when").max = frames.length - 1;
at("when").value = frames.length - 1;
at("when").addEventListener("input", panorama);
at("cut").addEventListener("input", cloud);
const canvas = at("cloud");
canvas.addEventListener("pointermove", (event) => {
    if (event.buttons !== 1) return;
    view.yaw += event.movementX * 0.008;
    view.pitch = Math.min(Math.max(view.pitch + event.movementY * 0.008, -1.5), 1.5);
    cloud();
});
canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.zoom = Math.min(Math.max(view.zoom * Math.exp(-event.deltaY * 0.001), 15), 600);
    cloud();
}, { passive: false });
curves(); cloud(); panorama(); senses();
document.body.dataset.drawn = "all";
