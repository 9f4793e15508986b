/* The page of `caustica render --serve`: the picture of a render that goes on, and what can be asked of it. src/live/server.h tells
 * what the server answers. */
"use strict";

(() => {
    const { Panes, Picture, toneTable, paintColor, colorTable, paintScalar, findRange, logRange, outside, format, element, make,
        displayControls } = Caustica;
    const wait = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

    const state = {
        told: null,              /* the last event */
        names: [],               /* of the picture's channels */
        planes: new Map(),       /* channels that are here, of the picture `version` */
        version: 0, passes: 0, width: 0, height: 0, x0: 0, y0: 0,
        layer: "color", exposure: 0, curve: "sRGB", map: "magma", range: null, log: false,
        pixel: null, pinned: false,
        lost: false, complete: false,
    };

    /* ---- Layers ----------------------------------------------------------------------------------------------------- */

    const colors = ["R", "G", "B"];
    const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

    /* Values made of channels. */
    const derived = [
        { key: "luminance", label: "luminance", needs: colors, at: luminance, what: "0.2126 R + 0.7152 G + 0.0722 B" },
        { key: "noise", label: "noise: standard error", needs: ["StandardDeviation.Y", "Samples.Y"],
            at: (deviation, samples) => deviation / Math.sqrt(samples), what: "standard error of the pixel's luminance so far" },
        { key: "relative-noise", label: "noise, relative", needs: ["StandardDeviation.Y", "Samples.Y", ...colors],
            at: (deviation, samples, r, g, b) => deviation / Math.sqrt(samples) / luminance(r, g, b),
            what: "standard error over luminance, of each pixel so far (magenta: black, it has none)" },
    ];

    function layers() {
        const has = (names) => names.every((name) => state.names.includes(name));
        const list = [{ key: "color", label: "R G B", needs: colors, color: true, what: "linear Rec. 709 radiance" }];
        for (const entry of derived) if (has(entry.needs)) list.push(entry);
        for (const name of state.names.filter((each) => each.endsWith(".R"))) {
            const group = name.slice(0, -2), needs = colors.map((c) => `${group}.${c}`);
            if (has(needs)) list.push({ key: `group:${group}`, label: `${group} (R G B)`, needs, color: true, what: `layers ${needs.join(", ")}` });
        }
        for (const name of state.names) {
            const component = /^Noise\./.test(name) ? ", a component of the noise" : "";
            list.push({ key: `layer:${name}`, label: name, needs: [name], at: (value) => value, what: `layer ${name}${component}` });
        }
        return list;
    }
    let layerList = layers();
    const display = displayControls(state, () => layerList, () => update(), () => paint()), { layer } = display;

    function showLayers() {
        layerList = layers();
        const select = element("layer");
        select.textContent = "";
        for (const entry of layerList) make(select, "option", "", entry.label).value = entry.key;
        select.value = layer().key;
    }

    /* ---- Fetching --------------------------------------------------------------------------------------------------- */

    /* Channels of one picture; null where the server asks to come back later. */
    async function fetchPlanes(names) {
        const answer = await fetch(`planes?names=${encodeURIComponent(names.join(","))}`);
        if (!answer.ok) return null;
        const version = Number(answer.headers.get("Caustica-Version")), data = await answer.arrayBuffer();
        const count = data.byteLength / 4 / names.length;
        return { version, planes: new Map(names.map((name, i) => [name, new Float32Array(data, 4 * i * count, count)])) };
    }

    async function fetchNames() {
        const answer = await fetch("layers");
        if (!answer.ok) return;
        state.names = (await answer.json()).names;
        showLayers();
    }

    function takePicture(found) {
        const picture = state.told.picture;
        if (found.version !== state.version) state.planes = new Map();
        for (const [name, values] of found.planes) state.planes.set(name, values);
        if (state.width !== picture.width || state.height !== picture.height) {
            Object.assign(state, { width: picture.width, height: picture.height, x0: picture.x0, y0: picture.y0 });
            panes.setSize(state.width, state.height);
        }
        state.version = found.version;
        if (found.version === picture.version) state.passes = picture.passes;
    }

    const complete = () => state.told && state.told.phase === "done";

    /* One picture after the other, never two at once: a slow connection sees fewer of them. */
    let busy = false, again = false;
    async function update() {
        again = true;
        if (busy) return;
        busy = true;
        try {
            while (again && state.told && state.told.picture) {
                again = false;
                if (state.names.length !== state.told.picture.channels) await fetchNames();
                const entry = layer(), missing = [...new Set([...colors, ...entry.needs])];
                const here = state.version === state.told.picture.version && missing.every((name) => state.planes.has(name));
                if (!here) {
                    const found = await fetchPlanes(missing);
                    if (!found) { await wait(200); again = true; continue; }
                    takePicture(found);
                }
                paint();
                showValues();
                if (complete()) await fetchAll();
            }
        } catch (problem) {
            if (!state.complete) lose();
        }
        busy = false;
    }

    /* Of the last picture everything is kept: the program ends. */
    async function fetchAll() {
        if (state.complete) return;
        await fetchNames();
        const rest = state.names.filter((name) => !state.planes.has(name));
        while (rest.length) {
            const found = await fetchPlanes(rest.slice(0, 8));
            if (!found) { await wait(200); continue; }
            takePicture(found);
            rest.splice(0, 8);
        }
        state.complete = true;
        events.close();
        showStatus();
        showValues();
    }

    /* ---- Painting --------------------------------------------------------------------------------------------------- */

    let picture = null, scalar = null, lastRange = null, beyond = [false, false];

    function scalarOf(entry) {
        const needed = entry.needs.map((name) => state.planes.get(name));
        if (needed.length === 1) return needed[0];
        const values = new Float32Array(needed[0].length), at = new Array(needed.length);
        for (let i = 0; i < values.length; i++) {
            for (let k = 0; k < needed.length; k++) at[k] = needed[k][i];
            values[i] = entry.at(...at);
        }
        return values;
    }

    function paint() {
        const entry = layer();
        if (!state.width || !entry.needs.every((name) => state.planes.has(name))) return;
        if (!picture || picture.canvas.width !== state.width || picture.canvas.height !== state.height)
            picture = new Picture(state.width, state.height);
        if (entry.color) {
            scalar = null;
            const table = toneTable(state.exposure, state.curve);
            picture.update((pixels) => paintColor(entry.needs.map((name) => state.planes.get(name)), table, pixels));
        } else {
            scalar = scalarOf(entry);
            const range = state.range || findRange([scalar]);
            lastRange = state.log ? logRange(range) : { ...range, log: false };
            beyond = outside([scalar], lastRange);
            picture.update((pixels) => paintScalar(scalar, colorTable(state.map), lastRange, pixels));
        }
        element("message").hidden = true;
        panes.show([{ picture, caption: document.title, right: `${state.told.blocks ? "block" : "pass"} ${state.passes}` }]);
        drawLegend();
    }

    function drawLegend() {
        const entry = layer();
        Caustica.drawLegend(entry, state, entry.color ? toneTable(state.exposure, state.curve) : null, state.map, lastRange, beyond);
    }

    /* ---- How far the render is ---------------------------------------------------------------------------------------- */

    function time(seconds) {
        if (seconds < 59.95) return `${seconds.toFixed(1)} s`;
        const whole = Math.round(seconds), two = (x) => String(x).padStart(2, "0");
        return whole < 3600 ? `${Math.floor(whole / 60)}:${two(whole % 60)}`
            : `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
    }

    // The prediction belongs to the estimate that it is made from, which may be older than the pass at work.
    function noiseText(t) {
        const target = t.target ? ` of ${format(t.target, 3)} %` : "";
        const end = t.predicted !== null && t.phase !== "done" ? `, so about ${format(t.predicted, 3)} % at the end` : "";
        return `noise ${format(t.noise, 3)} %${target} after pass ${t.noise_passes} (${time(t.noise_seconds)})${end}`;
    }

    function statusText() {
        const t = state.told;
        if (!t) return "connecting";
        const parts = [];
        if (state.lost) parts.push("connection lost");
        parts.push(t.phase);
        parts.push(`${t.blocks ? "block" : "pass"} ${t.passes}${t.total ? `/${t.total}` : ""}`);
        parts.push(`${time(t.seconds)} gone`);
        if (t.left !== null && t.phase !== "done") parts.push(`${time(t.left)} left`);
        if (t.noise !== null) parts.push(noiseText(t));
        if (t.picture && t.picture.light_paths) parts.push(`${t.picture.light_paths} light paths, ${format(t.picture.camera_paths, 3)} camera paths`);
        return parts.join("  ");
    }

    function showStatus() {
        const t = state.told, over = !t || state.lost || t.phase === "done" || t.phase === "stopping";
        element("status").textContent = statusText();
        element("said").textContent = t ? t.message : "";
        element("fraction").hidden = !t || t.fraction === null;
        if (t && t.fraction !== null) element("fraction").value = t.phase === "done" ? 1 : t.fraction;
        for (const id of ["pause", "stop", "save"]) element(id).disabled = over;
        element("pause").textContent = t && t.phase === "paused" ? "resume" : "pause";
    }

    function lose() {
        state.lost = true;
        showStatus();
    }

    const events = new EventSource("events");
    events.onmessage = (event) => {
        state.told = JSON.parse(event.data);
        state.lost = false;
        showStatus();
        update();
    };
    events.onerror = () => { if (!state.complete) lose(); };

    const post = (what) => fetch(what, { method: "POST" }).catch(lose);
    const pause = () => post(state.told && state.told.phase === "paused" ? "resume" : "pause");
    element("pause").addEventListener("click", () => { element("pause").blur(); pause(); });
    for (const id of ["stop", "save"]) element(id).addEventListener("click", () => { element(id).blur(); post(id); });

    /* ---- Pixels ------------------------------------------------------------------------------------------------------- */

    function labels(x, y) {
        const at = y * state.width + x;
        return scalar ? [format(scalar[at], 5)] : layer().needs.map((name) => format(state.planes.get(name)[at], 5));
    }

    const panes = new Panes(element("panes"), {
        onHover(pixel) { if (!state.pinned) { state.pixel = pixel; later(); } },
        onPick(pixel) { Object.assign(state, { pixel, pinned: true }); later(); },
        onView() { later(); },
        labels: (shown, x, y) => labels(x, y),
        marks: () => (state.pixel ? [{ x0: state.pixel.x, y0: state.pixel.y, x1: state.pixel.x + 1, y1: state.pixel.y + 1,
            color: state.pinned ? "#ffffff" : "#b0b0b0" }] : []),
    });

    let waiting = false;
    function later() {
        if (waiting) return;
        waiting = true;
        requestAnimationFrame(() => { waiting = false; panes.drawNow(); showValues(); });
    }

    /* Channels that are not here are asked for, one pixel at a time. */
    let asking = false, values = { version: 0, x: -1, y: -1, all: {} };
    async function askPixel() {
        const { x, y } = state.pixel;
        if (asking || state.complete || state.lost || (values.version === state.version && values.x === x && values.y === y)) return;
        asking = true;
        try {
            const answer = await fetch(`pixel?x=${x}&y=${y}`);
            if (answer.ok) {
                const found = await answer.json();
                values = { version: found.version, x, y, all: found.values };
            }
        } catch (problem) { lose(); }
        await wait(50);
        asking = false;
        if (state.pixel && (state.pixel.x !== x || state.pixel.y !== y || values.version < state.version)) later();
        else showTable();
    }

    function valueOf(name, at) {
        const plane = state.planes.get(name);
        if (plane) return format(plane[at], 9);
        const own = values.x === state.pixel.x && values.y === state.pixel.y && name in values.all;
        return own ? values.all[name] === null ? "not finite" : format(Math.fround(values.all[name]), 9) : "";
    }

    function showTable() {
        const { pixel } = state, body = element("values");
        element("table").hidden = !state.names.length; /* also without a pixel: images do not jump */
        if (!state.names.length) return;
        const at = pixel ? pixel.y * state.width + pixel.x : -1;
        /* The longest name with its value takes 34 letters. */
        const columns = Math.max(1, Math.min(4, Math.floor(element("table").clientWidth / 290))), rows = Math.ceil(state.names.length / columns);
        body.textContent = "";
        for (let i = 0; i < rows; i++) {
            const row = make(body, "tr");
            for (let k = 0; k < columns; k++) {
                const name = state.names[k * rows + i];
                make(row, "td", "left", name || "").dataset.channel = name || "";
                make(row, "td", "", (name && pixel ? valueOf(name, at) : "").padStart(16));
            }
        }
    }

    function showValues() {
        const { pixel } = state, { scale } = panes.view;
        const place = pixel ? `x ${String(pixel.x + state.x0).padStart(4)}  y ${String(pixel.y + state.y0).padStart(4)}${state.pinned ? " kept" : "     "}` : "";
        element("place").textContent = `${place}   zoom ${(100 * scale).toFixed(scale < 1 ? 1 : 0).padStart(4)} %`;
        showTable();
        if (pixel && state.width) askPixel();
    }

    /* ---- Being told what to do ---------------------------------------------------------------------------------------- */

    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const keys = {
        "+": () => panes.zoom(2), "=": () => panes.zoom(2), "-": () => panes.zoom(0.5), a: () => panes.fit(),
        z: () => panes.setScale(1 / (window.devicePixelRatio || 1)),
        Escape: () => { state.pinned = false; state.pixel = null; later(); },
        p: pause, ...display.keys,
    };
    document.addEventListener("keydown", (event) => {
        if (event.target.matches("input[type=text], select") || !state.width || event.ctrlKey || event.altKey || event.metaKey) return;
        if (event.shiftKey && event.key in arrows)
            panes.move(arrows[event.key][0] * 64 / panes.view.scale, arrows[event.key][1] * 64 / panes.view.scale);
        else if (event.key in keys)
            keys[event.key]();
        else
            return;
        event.preventDefault();
    });
    showLayers();
    drawLegend();
    new ResizeObserver(drawLegend).observe(element("scale"));
})();
