/* The page of `caustica compare --html`: images beside their reference, in one layer at a time. */
"use strict";

(() => {
    const { Panes, Picture, toneTable, paintColor, colorTable, paintScalar, outside, contextOf, format, digitsOf, element, make,
        displayControls } = Caustica;
    const { PlaneStore, PageImage, referenceOf, asked, channels, colorNames, previewNames, layersOf, hasLayer, scalarOf, scalarsOf,
        shownRange, colorAt, isKnown, errorText } = CausticaLayers;
    const pause = () => new Promise((resolve) => setTimeout(resolve));

    const settings = JSON.parse(element("settings").textContent);
    const state = {
        images: [],    /* in the order of the command line, the reference last: see order() */
        mode: "flip", current: 0, second: 0, before: 0,
        layer: "color", exposure: 0, curve: "sRGB", map: "magma", range: null, log: false,
        pixel: null, pinned: false,
    };

    /* ---- Images and their channels ---------------------------------------------------------------------------------- */

    const reference = () => referenceOf(state.images);
    const others = () => state.images.filter((image) => !image.reference);
    /* As keys and table number them: 1, 2, ... and the reference as 0, at the end. */
    const order = () => [...others(), ...(reference() ? [reference()] : [])];
    const shownNumber = (image) => (image.reference ? "0" : String(others().indexOf(image) + 1));

    /* ---- Layers ----------------------------------------------------------------------------------------------------- */

    let layerList = [];
    const display = displayControls(state, () => layerList, () => {
        lastRange = null;
        refresh().then(later);
    }, () => refresh());
    const { layer } = display;

    /* ---- Painting --------------------------------------------------------------------------------------------------- */

    let generation = 0, tone = { key: "", table: null }, beyond = [false, false], lastRange = null;

    function toneNow() {
        const key = `${state.exposure} ${state.curve}`;
        if (tone.key !== key) tone = { key, table: toneTable(state.exposure, state.curve) };
        return tone.table;
    }
    const mapName = (entry) => (entry.signed && state.map === "magma" ? "signed" : state.map);

    function paint(image, key, fill, size = [image.width, image.height]) {
        if (!image.picture || image.picture.canvas.width !== size[0]) {
            image.picture = new Picture(...size);
            image.picture.image = image;
        }
        image.picture.update(fill);
        image.painted = key;
    }

    /* Before its colours have arrived an image is shown small, without values. */
    async function paintPreview(image, entry) {
        const key = `preview ${state.exposure} ${state.curve}`;
        if (entry.key !== "color" || image.painted === key || !image.previewed) return;
        const planes = await Promise.all(previewNames.map((name) => image.values(name)));
        paint(image, key, (pixels) => paintColor(planes, toneNow(), pixels), image.preview);
    }

    async function paintImage(image, entry, range) {
        if (!received.has(image)) return paintPreview(image, entry);
        if (entry.color) {
            const key = `${entry.key} ${state.exposure} ${state.curve}`;
            if (image.painted === key) return;
            if (!hasLayer(image, entry)) return blank(image);
            const planes = await Promise.all(entry.planes.map((name) => image.values(name)));
            image.group = entry.key === "color" ? null : { key: entry.key, planes };
            paint(image, key, (pixels) => paintColor(planes, toneNow(), pixels));
            return;
        }
        const key = `${entry.key} ${mapName(entry)} ${range.low} ${range.high} ${range.log}`;
        if (image.painted === key) return;
        const values = await scalarOf(image, entry, reference());
        if (!values) return blank(image);
        paint(image, key, (pixels) => paintScalar(values, colorTable(mapName(entry)), range, pixels));
    }
    function blank(image) {
        image.painted = "";
        image.picture = null;
    }

    /* Side by side: those that have the layer. */
    const visible = () => {
        const list = order();
        if (state.mode === "grid") return list.filter((image) => hasLayer(image, layer()));
        return state.mode === "split" ? [list[state.current], list[state.second]] : [list[state.current]];
    };

    /* Paints what is seen, then all else, so that flipping does not wait. A newer call ends an older one. */
    async function refresh() {
        const mine = ++generation, entry = layer();
        if (!entry) return;
        for (const image of state.images) {
            if (image.scalar.layer !== entry.key) image.scalar = { layer: "", values: null };
            if (image.group && image.group.key !== entry.key) image.group = null;
        }
        let range = null;
        if (!entry.color) {
            for (const image of state.images) {
                if (image.scalar.layer === entry.key || !received.has(image)) continue;
                await scalarOf(image, entry, reference());
                await pause();
                if (mine !== generation) return;
            }
            range = lastRange = shownRange(state.images, entry, state.range, state.log);
            beyond = outside(scalarsOf(state.images, entry), range);
        }
        showPanes();
        drawLegend();
        const first = visible();
        for (const image of [...first, ...order().filter((each) => !first.includes(each))]) {
            if (!image) continue;
            await paintImage(image, entry, range);
            if (mine !== generation) return;
            if (visible().includes(image)) showPanes();
            if (received.has(image)) mark("first-image");
            await pause(); /* lets keys, drawing and the file's next part in */
            if (mine !== generation) return;
        }
        if (complete && received.size === state.images.length) mark("all-images");
        showValues();
    }

    function mark(name) {
        if (!performance.getEntriesByName(name).length) requestAnimationFrame(() => performance.mark(name));
    }

    /* ---- What stands around the images ------------------------------------------------------------------------------ */

    const panes = new Panes(element("panes"), {
        onHover(pixel) { if (!state.pinned) { state.pixel = pixel; later(); } },
        onPick(pixel) { Object.assign(state, { pixel, pinned: true }); later(); },
        onView() { showStatus(); },
        labels: (picture, x, y) => labels(picture.image, x, y),
        marks,
    });

    let waiting = false;
    function later() {
        if (waiting) return;
        waiting = true;
        requestAnimationFrame(() => { waiting = false; panes.drawNow(); showValues(); showStatus(); });
    }

    function marks() {
        const list = settings.masks.map(([x0, y0, x1, y1]) => ({ x0, y0, x1, y1, color: "#e06050" }));
        if (settings.roi) {
            const [x0, y0, x1, y1] = settings.roi;
            list.push({ x0, y0, x1, y1, color: "#60c0e0" });
        }
        if (state.pixel) {
            const { x, y } = state.pixel;
            list.push({ x0: x, y0: y, x1: x + 1, y1: y + 1, color: state.pinned ? "#ffffff" : "#b0b0b0" });
        }
        return list;
    }

    function showPanes() {
        element("message").hidden = true;
        const pane = (image, right) => ({ picture: image.picture, number: shownNumber(image), caption: image.name,
            right: right || (hasLayer(image, layer()) ? "" : image.reference ? "the reference has no such layer" : "has no such layer") });
        const list = visible();
        if (list.some((image) => !image)) return;
        if (state.mode === "split") {
            const [left, second] = list;
            panes.show([{ ...pane(left, `${second.name}   ${shownNumber(second)}`), second: { picture: second.picture } }]);
        } else {
            panes.show(list.map((image) => pane(image)));
        }
        for (const button of document.querySelectorAll("[data-mode]"))
            button.setAttribute("aria-pressed", String(button.dataset.mode === state.mode));
        showRows();
    }

    function drawLegend() {
        const entry = layer(), range = entry.color ? null : lastRange || shownRange(state.images, entry, state.range, state.log);
        Caustica.drawLegend(entry, state, toneNow(), mapName(entry), range, beyond);
    }

    function showStatus() {
        const { scale } = panes.view, pixel = state.pixel;
        const place = pixel ? `x ${String(pixel.x).padStart(4)}  y ${String(pixel.y).padStart(4)}${state.pinned ? " kept" : "     "}` : "";
        element("status").textContent = `${place}   ${(100 * scale).toFixed(scale < 1 ? 1 : 0).padStart(6)} %`;
    }

    /* ---- Values ----------------------------------------------------------------------------------------------------- */

    /* Luminance only where its interval is known. */
    const shownChannels = () => (state.images.some((image) => image.has("below:Y")) ? [...channels, "Y"] : channels);

    function scalarAt(image, at) {
        return image.scalar.layer === layer().key && image.scalar.values ? image.scalar.values[at] : null;
    }
    const layerDigits = (entry) => digitsOf(entry.bits || 16);

    /* What is written into a pixel that is large enough. */
    function labels(image, x, y) {
        const at = y * image.width + x, entry = layer();
        if (!entry.color) {
            const value = scalarAt(image, at);
            return value === null ? [] : [format(value, Math.min(5, layerDigits(entry)))];
        }
        if (image.group) return image.group.planes.map((plane) => format(plane[at], 5));
        return (panes.view.scale >= 150 ? shownChannels() : channels).flatMap((c) => {
            const found = colorAt(image, c, at);
            return found ? [format(found.value, 5), ...(panes.view.scale >= 100 && errorText(found) ? [errorText(found)] : [])] : [];
        });
    }

    /* The table: a row an image, with its metrics and its values at the pixel. */
    let rows = [], builtFor = "";
    function metricNames() {
        const names = [];
        for (const image of state.images) for (const { name } of image.metrics) if (!names.includes(name)) names.push(name);
        return names;
    }
    function bestOf(name) {
        const list = state.images.flatMap((image) => image.metrics).filter((m) => m.name === name && m.value !== null);
        if (!list.some((m) => m.value !== list[0].value) || list[0].better === "neither") return null;
        return (list[0].better === "lower" ? Math.min : Math.max)(...list.map((m) => m.value));
    }
    const metricText = (value) => (value === null ? "–" : Number.isInteger(value) && Math.abs(value) < 1e6 ? String(value) : format(value, 5));
    const valueWidth = (c) => (c === "Y" ? 11 : 13), errorWidth = (c) => (c === "Y" ? 17 : 9);

    function buildTable() {
        const key = JSON.stringify([state.images.length, layer().key, shownChannels()]);
        if (builtFor === key) return;
        builtFor = key;
        const root = element("table"), names = metricNames();
        root.textContent = "";
        const table = make(root, "table"), head = make(make(table, "thead"), "tr");
        make(head, "th", "left", "key");
        make(head, "th", "left", "image");
        names.forEach((name, i) => {
            const metric = state.images.flatMap((image) => image.metrics).find((m) => m.name === name);
            const sign = { lower: " ↓", higher: " ↑", neither: "" }[metric.better];
            make(head, "th", i ? "" : "first", name + sign).title = metric.meaning;
        });
        make(head, "th", "fill");
        const values = make(head, "th", "values");
        const text = layer().color ? shownChannels().map((c) => c.padStart(valueWidth(c)) + "".padEnd(errorWidth(c))).join("") : layer().label.padStart(26);
        make(values, "span", "", text);
        make(values, "span", "ends");
        const body = make(table, "tbody");
        rows = order().map((image, i) => {
            const row = make(body, "tr"), metrics = new Map(image.metrics.map((m) => [m.name, m.value]));
            make(row, "td", "left", shownNumber(image));
            make(row, "td", "left name", image.reference ? `${image.name} (reference)` : image.name).title = image.name;
            names.forEach((name, k) => {
                const value = metrics.has(name) ? metrics.get(name) : null, best = value !== null && value === bestOf(name);
                make(row, "td", `${k ? "" : "first"}${best ? " best" : ""}`, metricText(value));
            });
            make(row, "td", "fill");
            const cell = make(row, "td", "values"), spans = new Map();
            for (const c of layer().color ? shownChannels() : ["layer"])
                spans.set(c, { value: make(cell, "span", "value"), error: make(cell, "span", "error") });
            const plot = layer().key === "color" ? make(cell, "canvas") : null;
            row.addEventListener("click", () => choose(i));
            return { row, image, spans, plot };
        });
    }
    function showRows() {
        buildTable();
        const shown = visible();
        for (const { row, image } of rows) row.className = shown.includes(image) ? "shown" : "";
    }

    function showValues() {
        if (!rows.length) return;
        const { pixel } = state, entry = layer();
        const at = pixel ? pixel.y * state.images[0].width + pixel.x : -1;
        element("table").classList.toggle("idle", !pixel);
        const found = rows.map(({ image }) => shownChannels().map((c) => (at < 0 ? null : colorAt(image, c, at))));
        rows.forEach(({ image, spans }, i) => {
            if (!entry.color) {
                const value = at < 0 ? null : scalarAt(image, at);
                spans.get("layer").value.textContent = (value === null ? "" : format(value, layerDigits(entry))).padStart(26);
                return;
            }
            shownChannels().forEach((c, k) => {
                const group = image.group && k < 3 ? { value: image.group.planes[k][at], error: null, interval: null } : null;
                const own = entry.key === "color" ? found[i][k] : at < 0 ? null : group;
                const digits = entry.key !== "color" ? 5 : c === "Y" ? 7 : 9;
                spans.get(c).value.textContent = (own ? format(own.value, digits) : "").padStart(valueWidth(c));
                spans.get(c).error.textContent = (own ? ` ${errorText(own)}` : "").padEnd(errorWidth(c));
            });
        });
        if (entry.key === "color") drawPlots(found);
    }

    /* Values and their 95 % intervals of all images on one axis, whose ends stand above. */
    function drawPlots(found) {
        const all = found.flat().filter((f) => f && Number.isFinite(f.value)), head = document.querySelector(".ends");
        if (!all.length) {
            head.textContent = "".padEnd(20);
            for (const { plot } of rows) contextOf(plot);
            return;
        }
        const ends = all.flatMap((f) => [f.value, ...(f.interval || [])]).filter(Number.isFinite);
        let low = Math.min(...ends), high = Math.max(...ends);
        if (!(high > low)) { low -= Math.abs(low) * 0.1 || 1; high += Math.abs(high) * 0.1 || 1; }
        head.textContent = format(low, 3).padEnd(10) + format(high, 3).padStart(10);
        const inside = (x) => Math.max(low, Math.min(high, x));
        rows.forEach(({ plot }, i) => {
            const context = contextOf(plot), x = (v) => 2 + (inside(v) - low) / (high - low) * (plot.clientWidth - 4);
            const step = 18 / found[i].length;
            ["#ff6a5a", "#55cc66", "#6a9aff", "#d0d0d0"].slice(0, found[i].length).forEach((color, k) => {
                const f = found[i][k];
                if (!f || !Number.isFinite(f.value)) return;
                const y = Math.round(1 + (k + 0.5) * step);
                context.fillStyle = color;
                if (f.interval && isKnown(f.interval)) context.fillRect(x(f.interval[0]), y, x(f.interval[1]) - x(f.interval[0]), 1);
                context.fillRect(Math.round(x(f.value)) - 1, y - 2, 3, 5);
            });
        });
    }

    /* ---- Being told what to do -------------------------------------------------------------------------------------- */

    function choose(number) {
        if (number < 0 || number >= order().length) return;
        if (number !== state.current) state.before = state.current;
        state.current = number;
        if (state.mode === "grid") setMode("flip"); else refresh();
    }
    function setMode(mode) {
        state.mode = mode;
        if (mode === "split" && state.second === state.current) state.second = order().length - 1;
        if (mode === "split" && state.second === state.current) state.second = 0;
        refresh();
    }
    function showTable() {
        element("table").hidden = !element("table").hidden;
    }
    function back() {
        const last = order().length - 1; /* the reference */
        choose(state.current === last ? state.before : last);
    }
    function movePixel(dx, dy) {
        const { width, height } = state.images[0], from = state.pixel || { x: Math.floor(panes.view.x), y: Math.floor(panes.view.y) };
        state.pixel = { x: Math.max(0, Math.min(width - 1, from.x + dx)), y: Math.max(0, Math.min(height - 1, from.y + dy)) };
        state.pinned = true;
        later();
    }
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

    const keys = {
        " ": back, f: () => setMode("flip"), g: () => setMode("grid"), s: () => setMode("split"),
        "[": () => panes.setSplit(panes.split - 0.01), "]": () => panes.setSplit(panes.split + 0.01),
        "+": () => zoomKey(2), "=": () => zoomKey(2), "-": () => zoomKey(0.5), a: () => panes.fit(), z: () => zoomTo(1),
        Escape: () => { state.pinned = false; state.pixel = null; later(); },
        m: showTable, ...display.keys, "?": () => element("help").showModal(),
        ArrowLeft: () => choose((state.current + order().length - 1) % order().length),
        ArrowRight: () => choose((state.current + 1) % order().length),
    };
    /* About the pixel that is kept, if any. */
    function zoomKey(factor) {
        if (state.pinned && state.pixel) panes.center(state.pixel.x, state.pixel.y);
        panes.zoom(factor);
    }
    function zoomTo(scale) { panes.setScale(scale / (window.devicePixelRatio || 1)); }

    document.addEventListener("keydown", (event) => {
        if (event.target.matches("input[type=text], select") || element("help").open || !state.images.length) return;
        const digit = /^Digit([0-9])$/.exec(event.code);
        if (digit && !event.ctrlKey && !event.metaKey) {
            const number = digit[1] === "0" ? order().length - 1 : Number(digit[1]) - 1;
            if (number >= (digit[1] === "0" ? order().length : others().length)) return;
            if (event.altKey && state.mode === "split") { state.second = number; refresh(); } else choose(number);
        } else if (event.shiftKey && event.key in arrows) {
            const size = 64 / panes.view.scale;
            panes.move(arrows[event.key][0] * size, arrows[event.key][1] * size);
        } else if (event.ctrlKey && event.key in arrows) {
            movePixel(...arrows[event.key]);
        } else if (event.key in keys && !event.ctrlKey && !event.altKey && !event.metaKey) {
            keys[event.key]();
        } else {
            return;
        }
        event.preventDefault();
    });
    for (const button of document.querySelectorAll("[data-mode]"))
        button.addEventListener("click", () => { button.blur(); setMode(button.dataset.mode); });
    element("help-button").addEventListener("click", () => { element("help-button").blur(); element("help").showModal(); });
    new ResizeObserver(() => { if (layerList.length) drawLegend(); }).observe(element("scale"));

    /* ---- Reading the page ------------------------------------------------------------------------------------------- */

    let complete = false;       /* are all images known? */
    const received = new Set(); /* those whose colours are there */
    function addImage(record) {
        const image = new PageImage({ ...JSON.parse(record.textContent), number: record.dataset.image }, store);
        if (!state.images.length) panes.setSize(image.width, image.height);
        const kept = order()[state.current];
        state.images.push(image);
        if (kept) state.current = kept.reference && others().length === 1 ? 0 : order().indexOf(kept);
        layerList = layersOf(state.images);
        const select = element("layer");
        select.textContent = "";
        for (const entry of layerList) make(select, "option", "", entry.label).value = entry.key;
        select.value = state.layer;
        const read = (names) => Promise.all(names.map((name) => image.values(name)));
        const complain = (problem) => {
            element("message").hidden = false;
            element("message").textContent = `${image.name}: ${problem.message}`;
        };
        read(previewNames).then(async () => {
            image.previewed = true;
            if (!received.has(image)) await paintPreview(image, layer());
            showPanes();
            if (complete && state.images.every((each) => each.previewed)) mark("previews");
        }).catch(complain);
        read(colorNames).then(() => { received.add(image); return refresh(); }).catch(complain);
        showPanes();
    }
    const store = new PlaneStore(document.currentScript, (record) => {
        if ("image" in record.dataset) addImage(record);
        if (record.id === "all-images") complete = true;
    });
    /* Errors of the values are wanted for the pixel under the pointer, after the images. */
    document.addEventListener("DOMContentLoaded", async () => {
        const each = (wanted) => Promise.all(state.images.flatMap((image) => [...image.planes.keys()]
            .filter((name) => wanted.test(name)).map((name) => image.values(name))));
        await each(/^color:/);
        await refresh();
        await each(asked);
        performance.mark("all-errors");
        later();
    });
})();
