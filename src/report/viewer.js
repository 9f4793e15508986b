/* What all pages share: tone curves and colour maps, a scale bar, panes with one zoom and place, the controls of how values are
 * displayed, numbers. Knows nothing of what the images are. */
"use strict";

const Caustica = (() => {
    /* ---- Tone curves and colour maps -------------------------------------------------------------------------------- */

    const srgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055); /* IEC 61966-2-1 */
    /* From exposed linear light to what a screen is sent, 0 to 1. `white`: where it reaches 1, or the end of the scale. */
    const toneCurves = {
        "sRGB": { white: 1, at: (x) => srgb(Math.min(x, 1)) },
        "x / (1 + x), sRGB": { white: 16, at: (x) => srgb(x / (1 + x)) },
        "log, 10 stops": { white: 1, at: (x) => Math.min(Math.max(1 + Math.log2(x) / 10, 0), 1) },
        "linear": { white: 1, at: (x) => Math.min(x, 1) },
    };

    const notFinite = 256, magenta = 0xffff00ff;

    /* Screen values by the 18 leading bits of a positive float: a step is 0.2 % of the value, less than one of 256 levels. */
    function toneTable(exposure, curve) {
        const table = new Uint16Array(1 << 17), scale = 2 ** exposure, at = toneCurves[curve].at;
        const word = new Uint32Array(1), value = new Float32Array(word.buffer);
        for (let i = 0; i < table.length; i++) {
            word[0] = i << 14 | 1 << 13;
            table[i] = i >= 255 << 9 ? notFinite : Math.round(255 * at(value[0] * scale));
        }
        return table;
    }

    /* Negative light is black. */
    function paintColor(planes, table, pixels) {
        const [r, g, b] = planes.map((plane) => new Uint32Array(plane.buffer, plane.byteOffset, plane.length));
        const level = (bits) => (bits < 0x80000000 ? table[bits >>> 14]
            : (bits & 0x7f800000) === 0x7f800000 ? notFinite : 0);
        for (let i = 0; i < r.length; i++) {
            const x = level(r[i]), y = level(g[i]), z = level(b[i]);
            pixels[i] = (x | y | z) > 255 ? magenta : 0xff000000 | z << 16 | y << 8 | x;
        }
    }

    /* Colours at equal steps from 0 to 1. Magma: each 16th of the table in matplotlib's lib/matplotlib/_cm_listed.py. The
     * signed map is darkest at 0.5, so that what differs shines. */
    const colorMaps = {
        "magma": [[0, 0, 4], [10, 8, 34], [29, 17, 71], [54, 16, 107], [81, 18, 124], [106, 28, 129], [131, 38, 129],
            [156, 46, 127], [183, 55, 121], [208, 65, 111], [231, 82, 99], [245, 107, 92], [252, 137, 97], [254, 167, 114],
            [254, 196, 136], [253, 226, 163], [252, 253, 191]],
        "grey": [[0, 0, 0], [255, 255, 255]],
        "signed": [[150, 220, 255], [40, 130, 230], [10, 50, 120], [12, 12, 12], [120, 40, 10], [230, 110, 30],
            [255, 220, 150]],
    };
    function colorTable(name) {
        const colors = colorMaps[name], table = new Uint32Array(1024);
        for (let i = 0; i < table.length; i++) {
            const t = i / (table.length - 1) * (colors.length - 1), k = Math.min(Math.floor(t), colors.length - 2);
            const [r, g, b] = [0, 1, 2].map((c) => Math.round(colors[k][c] + (t - k) * (colors[k + 1][c] - colors[k][c])));
            table[i] = (0xff000000 | b << 16 | g << 8 | r) >>> 0;
        }
        return table;
    }

    /* Where a value lies in a range, 0 to 1 within it. */
    function placeIn(range) {
        if (!range.log) return (value) => (value - range.low) / (range.high - range.low);
        const low = Math.log(range.low), width = Math.log(range.high) - low;
        return (value) => (value > 0 ? (Math.log(value) - low) / width : -1);
    }

    function paintScalar(values, colors, range, pixels) {
        const place = placeIn(range), last = colors.length - 1;
        for (let i = 0; i < values.length; i++) {
            const v = values[i];
            pixels[i] = Number.isFinite(v) ? colors[Math.max(0, Math.min(last, Math.round(place(v) * last)))] : magenta;
        }
    }

    /* ---- Numbers ---------------------------------------------------------------------------------------------------- */

    /* Decimal digits that tell floats of so many significant bits apart, or are all that they hold. */
    const digitsOf = (bits) => (bits >= 24 ? 9 : Math.max(2, Math.floor((bits - 1) * Math.LOG10E * Math.LN2) + (bits > 8 ? 1 : 0)));

    function format(value, digits) {
        if (!Number.isFinite(value)) return Number.isNaN(value) ? "NaN" : value > 0 ? "inf" : "-inf";
        if (value === 0) return "0";
        const size = Math.abs(value);
        return size >= 1e-4 && size < 1e6 ? value.toPrecision(digits) : value.toExponential(digits - 1);
    }

    /* Round numbers in a range, at most `most` of them. */
    function ticks(range, most) {
        const result = [];
        if (range.log) {
            const low = Math.ceil(Math.log10(range.low) - 1e-9), high = Math.floor(Math.log10(range.high) + 1e-9);
            const step = Math.max(1, Math.ceil((high - low + 1) / most));
            for (let k = low; k <= high; k += step) result.push(10 ** k);
            return result.length > 1 ? result : [range.low, range.high];
        }
        const rough = (range.high - range.low) / most, power = 10 ** Math.floor(Math.log10(rough));
        const step = [1, 2, 5, 10].map((x) => x * power).find((x) => x >= rough) || 10 * power;
        for (let k = Math.ceil(range.low / step - 1e-9); k * step <= range.high + 1e-9 * step; k++)
            result.push(Number((k * step).toPrecision(12)));
        return result;
    }

    /* Sizes a canvas to its place on the screen; its context in screen units. */
    function contextOf(canvas) {
        const ratio = window.devicePixelRatio || 1;
        const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
        if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
        const context = canvas.getContext("2d");
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        context.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
        return context;
    }

    /* A bar of colours over its numbers. colorAt: the colour of a value; below, above: are there values beyond the ends? */
    function drawScale(canvas, range, colorAt, below, above) {
        const context = contextOf(canvas), width = canvas.clientWidth, place = placeIn(range);
        const left = 44, right = width - 44, high = 16;
        for (let x = left; x < right; x++) {
            const t = (x - left + 0.5) / (right - left);
            const value = range.log ? Math.exp(Math.log(range.low) + t * Math.log(range.high / range.low))
                : range.low + t * (range.high - range.low);
            context.fillStyle = colorAt(value);
            context.fillRect(x, 2, 1, high);
        }
        const triangle = (x, sign, color) => {
            context.fillStyle = color;
            context.beginPath();
            context.moveTo(x, 2);
            context.lineTo(x + sign * 12, 2 + high / 2);
            context.lineTo(x, 2 + high);
            context.fill();
        };
        if (below) triangle(left - 2, -1, colorAt(range.low));
        if (above) triangle(right + 2, 1, colorAt(range.high));
        context.strokeStyle = "#606060";
        context.strokeRect(left - 0.5, 1.5, right - left + 1, high + 1);
        context.fillStyle = "#b8b8b8";
        context.font = "11px DejaVu Sans Mono, Liberation Mono, monospace";
        context.textAlign = "center";
        for (const value of ticks(range, 6)) {
            const x = left + place(value) * (right - left);
            context.fillRect(Math.round(x), 2 + high, 1, 4);
            context.fillText(value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e5) ? value.toExponential()
                : String(value), x, 33);
        }
    }

    const cssColor = (word) => `rgb(${word & 255} ${word >>> 8 & 255} ${word >>> 16 & 255})`;

    /* ---- Ranges ----------------------------------------------------------------------------------------------------- */

    /* The range of 98 of 100 finite values of all these arrays, from every so many of them; about 0 for a layer with a sign. */
    function findRange(arrays, signed) {
        const sample = [];
        for (const values of arrays) {
            const step = Math.max(1, Math.floor(values.length / 9973));
            for (let i = 0; i < values.length; i += step) if (Number.isFinite(values[i])) sample.push(values[i]);
        }
        if (!sample.length) return { low: 0, high: 1 };
        sample.sort((x, y) => x - y);
        const at = (t) => sample[Math.round(t * (sample.length - 1))];
        if (signed) {
            const size = Math.max(-at(0.01), at(0.99)) || 1;
            return { low: -size, high: size };
        }
        const low = at(0) >= 0 ? 0 : at(0.01), high = at(0.99) > low ? at(0.99) : at(1);
        return high > low ? { low, high } : { low: low - 0.5, high: low + 0.5 };
    }

    /* A logarithmic scale needs a positive end: else four decades below the upper one. */
    function logRange(range) {
        const high = range.high > 0 ? range.high : 1;
        return { low: range.low > 0 && range.low < high ? range.low : high * 1e-4, high, log: true };
    }

    /* Are there values below and above the range? */
    const outside = (arrays, { low, high }) => [arrays.some((values) => values.some((v) => v < low)),
        arrays.some((values) => values.some((v) => v > high))];

    /* ---- Panes ------------------------------------------------------------------------------------------------------ */

    /* An image ready to be drawn: a canvas of its own size. */
    class Picture {
        constructor(width, height) {
            this.canvas = document.createElement("canvas");
            this.canvas.width = width;
            this.canvas.height = height;
            this.context = this.canvas.getContext("2d");
        }
        /* paint(pixels): fills a Uint32Array of ABGR words. */
        update(paint) {
            const data = new ImageData(this.canvas.width, this.canvas.height);
            this.pixels = new Uint32Array(data.data.buffer);
            paint(this.pixels);
            this.context.putImageData(data, 0, 0);
        }
        isBright(x, y) {
            const word = this.pixels[y * this.canvas.width + x];
            return 0.3 * (word & 255) + 0.59 * (word >>> 8 & 255) + 0.11 * (word >>> 16 & 255) > 110;
        }
    }

    const largestPixel = 192, labelPixel = 72, gridPixel = 12;

    /* Panes side by side that show the same part of their images. A pane: { caption, right, picture, second } where the
     * picture (or null) is a Picture, `second` another right of the split, and caption and right are texts. */
    class Panes {
        constructor(root, handlers) {
            this.root = root;
            this.handlers = handlers; /* onHover({x, y} or null), onPick({x, y}), onView(), labels(picture, x, y), marks() */
            this.panes = [];
            this.width = this.height = 0;
            this.view = { x: 0, y: 0, scale: 1 }; /* image point at the pane's centre; screen units a pixel */
            this.fitted = true;
            this.split = 0.5;
            this.frame = 0;
            new ResizeObserver(() => { this.layOut(); if (this.fitted) this.fit(); this.draw(); }).observe(root);
        }
        setSize(width, height) {
            Object.assign(this, { width, height });
            this.fit();
        }
        show(panes) {
            while (this.panes.length > panes.length) this.panes.pop().element.remove();
            while (this.panes.length < panes.length) this.panes.push(this.makePane());
            panes.forEach((pane, i) => {
                const mine = this.panes[i];
                Object.assign(mine, { picture: pane.picture, second: pane.second || null });
                mine.number.textContent = pane.number || "";
                mine.caption.textContent = pane.caption || "";
                mine.right.textContent = pane.right || "";
                mine.handle.hidden = !pane.second;
            });
            this.layOut();
            if (this.fitted) this.fit();
            this.draw();
        }
        makePane() {
            const add = (parent, tag, name) => {
                const element = document.createElement(tag);
                element.className = name;
                parent.append(element);
                return element;
            };
            const element = add(this.root, "div", "pane"), head = add(element, "div", "caption");
            const pane = { element, number: add(head, "b", ""), caption: add(head, "span", ""), right: add(head, "span", "right"),
                canvas: add(element, "canvas", ""), handle: add(element, "div", "split") };
            this.listen(pane);
            return pane;
        }
        /* As many columns as make the images largest. */
        layOut() {
            const { clientWidth: width, clientHeight: height } = this.root, count = this.panes.length;
            let best = 1, bestScale = 0;
            for (let columns = 1; columns <= count; columns++) {
                const rows = Math.ceil(count / columns);
                const scale = Math.min(width / columns / (this.width || 1), (height / rows - 22) / (this.height || 1));
                if (scale > bestScale) { best = columns; bestScale = scale; }
            }
            this.root.style.gridTemplateColumns = `repeat(${best}, minmax(0, 1fr))`;
            this.root.style.gridTemplateRows = `repeat(${Math.max(1, Math.ceil(count / best))}, minmax(0, 1fr))`;
        }
        fit() {
            const canvas = this.panes.length ? this.panes[0].canvas : null;
            if (!canvas || !this.width) return;
            const scale = Math.min(canvas.clientWidth / this.width, canvas.clientHeight / this.height) || 1;
            this.view = { x: this.width / 2, y: this.height / 2, scale: scale >= 1 ? Math.floor(scale) : scale };
            this.fitted = true;
            this.changed();
        }
        changed() {
            this.draw();
            if (this.handlers.onView) this.handlers.onView();
        }
        /* Zooms by a factor about a place in the pane (its centre without one), which stays where it is. */
        zoom(factor, at) {
            const canvas = this.panes[0].canvas, { x, y, scale } = this.view;
            const place = at || { x: canvas.clientWidth / 2, y: canvas.clientHeight / 2 };
            const least = Math.min(canvas.clientWidth / this.width, canvas.clientHeight / this.height, 1) / 2;
            const next = Math.max(least, Math.min(largestPixel, scale * factor));
            const dx = place.x - canvas.clientWidth / 2, dy = place.y - canvas.clientHeight / 2;
            this.view = { x: x + dx / scale - dx / next, y: y + dy / scale - dy / next, scale: next };
            this.move(0, 0);
        }
        setScale(scale) { this.zoom(scale / this.view.scale); }
        /* In pixels of the image. */
        move(dx, dy) {
            this.view.x = Math.max(0, Math.min(this.width, this.view.x + dx));
            this.view.y = Math.max(0, Math.min(this.height, this.view.y + dy));
            this.fitted = false;
            this.changed();
        }
        center(x, y) { this.move(x + 0.5 - this.view.x, y + 0.5 - this.view.y); }
        pixelAt(canvas, event) {
            const box = canvas.getBoundingClientRect(), { x, y, scale } = this.view;
            const px = Math.floor(x + (event.clientX - box.left - box.width / 2) / scale);
            const py = Math.floor(y + (event.clientY - box.top - box.height / 2) / scale);
            return px >= 0 && py >= 0 && px < this.width && py < this.height ? { x: px, y: py } : null;
        }
        listen(pane) {
            const { canvas, element, handle } = pane;
            let held = null, moved = false;
            canvas.addEventListener("wheel", (event) => {
                event.preventDefault();
                const box = canvas.getBoundingClientRect();
                this.zoom(2 ** (-event.deltaY / (event.deltaMode ? 6 : 240)),
                    { x: event.clientX - box.left, y: event.clientY - box.top });
                this.handlers.onHover(this.pixelAt(canvas, event));
            }, { passive: false });
            canvas.addEventListener("pointerdown", (event) => {
                canvas.setPointerCapture(event.pointerId);
                held = { x: event.clientX, y: event.clientY };
                moved = false;
            });
            canvas.addEventListener("pointermove", (event) => {
                if (held && (moved || Math.hypot(event.clientX - held.x, event.clientY - held.y) > 3)) {
                    moved = true;
                    element.classList.add("moving");
                    this.move((held.x - event.clientX) / this.view.scale, (held.y - event.clientY) / this.view.scale);
                    held = { x: event.clientX, y: event.clientY };
                }
                this.handlers.onHover(this.pixelAt(canvas, event));
            });
            canvas.addEventListener("pointerup", (event) => {
                const pixel = this.pixelAt(canvas, event);
                if (held && !moved && pixel) this.handlers.onPick(pixel);
                held = null;
                element.classList.remove("moving");
            });
            canvas.addEventListener("pointerleave", () => this.handlers.onHover(null));
            handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
            handle.addEventListener("pointermove", (event) => {
                if (!handle.hasPointerCapture(event.pointerId)) return;
                const box = canvas.getBoundingClientRect();
                this.setSplit((event.clientX - box.left) / box.width);
            });
        }
        setSplit(split) {
            this.split = Math.max(0, Math.min(1, split));
            this.changed();
        }
        draw() {
            if (!this.frame) this.frame = requestAnimationFrame(() => { this.frame = 0; this.drawNow(); });
        }
        drawNow() { for (const pane of this.panes) this.drawPane(pane); }
        drawPane(pane) {
            const context = contextOf(pane.canvas), width = pane.canvas.clientWidth, height = pane.canvas.clientHeight;
            const splitAt = Math.round(this.split * width);
            pane.handle.style.left = `${splitAt}px`;
            if (pane.second) {
                this.drawClipped(context, pane.picture, 0, splitAt, width, height);
                this.drawClipped(context, pane.second.picture, splitAt, width, width, height);
            } else {
                this.drawClipped(context, pane.picture, 0, width, width, height);
            }
            this.drawMarks(context, width, height);
        }
        drawClipped(context, picture, from, to, width, height) {
            if (!picture) return;
            context.save();
            context.beginPath();
            context.rect(from, 0, to - from, height);
            context.clip();
            const part = this.visible(width, height), { x, y, scale } = this.view;
            const shrink = picture.canvas.width / this.width; /* 1, but for a preview */
            context.imageSmoothingEnabled = scale * (window.devicePixelRatio || 1) < 1 || shrink < 1;
            context.imageSmoothingQuality = "medium";
            context.drawImage(picture.canvas, part.x0 * shrink, part.y0 * shrink, (part.x1 - part.x0) * shrink, (part.y1 - part.y0) * shrink,
                width / 2 + (part.x0 - x) * scale, height / 2 + (part.y0 - y) * scale, (part.x1 - part.x0) * scale,
                (part.y1 - part.y0) * scale);
            if (scale >= gridPixel) this.drawGrid(context, part, width, height);
            if (scale >= labelPixel && shrink === 1) this.drawLabels(context, part, picture, from, to, width, height);
            context.restore();
        }
        /* The pixels that can be seen. */
        visible(width, height) {
            const { x, y, scale } = this.view;
            return {
                x0: Math.max(0, Math.floor(x - width / 2 / scale)), x1: Math.min(this.width, Math.ceil(x + width / 2 / scale)),
                y0: Math.max(0, Math.floor(y - height / 2 / scale)),
                y1: Math.min(this.height, Math.ceil(y + height / 2 / scale)),
            };
        }
        drawGrid(context, part, width, height) {
            const { x, y, scale } = this.view;
            context.fillStyle = "rgba(128, 128, 128, 0.25)";
            for (let i = part.x0; i <= part.x1; i++) context.fillRect(Math.round(width / 2 + (i - x) * scale), 0, 1, height);
            for (let i = part.y0; i <= part.y1; i++) context.fillRect(0, Math.round(height / 2 + (i - y) * scale), width, 1);
        }
        drawLabels(context, part, picture, from, to, width, height) {
            const { x, y, scale } = this.view, size = Math.min(13, scale / 8);
            context.font = `${size}px DejaVu Sans Mono, Liberation Mono, monospace`;
            context.textAlign = "center";
            for (let j = part.y0; j < part.y1; j++)
                for (let i = part.x0; i < part.x1; i++) {
                    const left = width / 2 + (i - x) * scale, top = height / 2 + (j - y) * scale;
                    if (left + scale < from || left > to) continue;
                    const lines = this.handlers.labels(picture, i, j);
                    context.fillStyle = picture.isBright(i, j) ? "#000" : "#fff";
                    lines.forEach((line, k) => context.fillText(line, left + scale / 2,
                        top + scale / 2 + (k - lines.length / 2 + 0.8) * size * 1.25));
                }
        }
        /* The pixel whose values are shown, and rectangles. */
        drawMarks(context, width, height) {
            const { x, y, scale } = this.view;
            for (const mark of this.handlers.marks()) {
                const left = width / 2 + (mark.x0 - x) * scale, top = height / 2 + (mark.y0 - y) * scale;
                const w = Math.max((mark.x1 - mark.x0) * scale, 5), h = Math.max((mark.y1 - mark.y0) * scale, 5);
                context.strokeStyle = "rgba(0, 0, 0, 0.8)";
                context.strokeRect(left - 1, top - 1, w + 2, h + 2);
                context.strokeStyle = mark.color;
                context.strokeRect(left, top, w, h);
            }
        }
    }

    /* ---- Controls of the display ------------------------------------------------------------------------------------ */

    const element = (id) => document.getElementById(id);
    const make = (parent, tag, name = "", text = "") =>
        parent.appendChild(Object.assign(document.createElement(tag), { className: name, textContent: text }));

    /* The bar over the images: which layer, exposure and curve of colours, map and range of other layers. state: has them, as
     * { layer, exposure, curve, map, range, log }; list(): the layers; layerChanged(), changed(): afterwards. Result: keys and what
     * they do, and `layer()`, the one that is shown. */
    function displayControls(state, list, layerChanged, changed) {
        const layer = () => list().find((entry) => entry.key === state.layer) || list()[0];
        const step = (all, value, by) => all[(all.indexOf(value) + by + all.length) % all.length];
        function setLayer(key) {
            Object.assign(state, { layer: key, range: null });
            element("layer").value = key;
            layerChanged();
        }
        const stepLayer = (by) => setLayer(step(list().map((entry) => entry.key), layer().key, by));
        function set(values) {
            Object.assign(state, values);
            for (const id of ["curve", "map"]) element(id).value = state[id];
            element("log").checked = state.log;
            element("exposure").value = String(Number(state.exposure.toFixed(3)));
            changed();
        }
        const setExposure = (stops) => set({ exposure: Math.max(-30, Math.min(30, stops)) });
        const automatic = () => set(layer().color ? { range: null, exposure: 0 } : { range: null });
        function setRange() {
            const [low, high] = ["low", "high"].map((id) => (element(id).value.trim() ? Number(element(id).value) : NaN));
            set(Number.isFinite(low) && Number.isFinite(high) && high > low ? { range: { low, high } } : {});
        }
        const onChange = (id, action) => element(id).addEventListener("change", () => { element(id).blur(); action(element(id)); });
        onChange("layer", (select) => setLayer(select.value));
        for (const id of ["curve", "map"]) onChange(id, (select) => set({ [id]: select.value }));
        onChange("log", (box) => set({ log: box.checked }));
        onChange("exposure", (input) => setExposure(Number(input.value) || 0));
        for (const id of ["low", "high"]) onChange(id, setRange);
        element("auto").addEventListener("click", () => { element("auto").blur(); automatic(); });
        for (const name of Object.keys(toneCurves)) make(element("curve"), "option", "", name);
        for (const name of Object.keys(colorMaps)) make(element("map"), "option", "", name);
        const keys = {
            l: () => stepLayer(1), k: () => stepLayer(-1), e: () => setExposure(state.exposure + 0.5),
            d: () => setExposure(state.exposure - 0.5), t: () => set({ curve: step(Object.keys(toneCurves), state.curve, 1) }),
            c: () => set({ map: step(Object.keys(colorMaps), state.map, 1) }), o: () => set({ log: !state.log }), r: automatic,
        };
        return { layer, keys };
    }

    /* What is displayed how: which controls count, the scale of the layer `entry` and its ends. tone: the table of colours; map,
     * range, beyond: of other layers. */
    function drawLegend(entry, state, tone, map, range, beyond) {
        const canvas = element("scale");
        for (const part of document.querySelectorAll(".for-color")) part.hidden = !entry.color;
        for (const part of document.querySelectorAll(".for-scalar")) part.hidden = Boolean(entry.color);
        element("what").textContent = entry.what;
        if (entry.color) {
            const word = new Uint32Array(1), value = new Float32Array(word.buffer);
            const high = toneCurves[state.curve].white / 2 ** state.exposure, log = state.curve.startsWith("log");
            drawScale(canvas, { low: log ? high / 1024 : 0, high, log }, (v) => {
                value[0] = v;
                const level = tone[word[0] >>> 14];
                return `rgb(${level} ${level} ${level})`;
            }, false, true);
            return;
        }
        if (!range) return;
        const colors = colorTable(map), place = placeIn(range);
        drawScale(canvas, range, (v) => cssColor(colors[Math.max(0, Math.min(1023, Math.round(place(v) * 1023)))]), ...beyond);
        for (const [id, value] of [["low", range.low], ["high", range.high]])
            if (document.activeElement !== element(id)) element(id).value = format(value, 4);
    }

    return { Panes, Picture, toneTable, paintColor, colorTable, paintScalar, findRange, logRange, outside, contextOf, format, digitsOf,
        element, make, displayControls, drawLegend };
})();
