/* What all pages share: channels out of the page's text, tone curves and colour maps, panes with one zoom and place, a
 * scale bar, numbers. Knows nothing of what the images are. */
"use strict";

const Caustica = (() => {
    /* ---- Channels: the counterpart of src/report/plane.h ------------------------------------------------------------ */

    const bytesOf = Uint8Array.fromBase64 ? (text) => Uint8Array.fromBase64(text)
        : (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

    /* Inflates a zlib stream that comes in pieces of base64 to exactly `size` bytes. */
    async function inflate(texts, size) {
        const stream = new DecompressionStream("deflate"), result = new Uint8Array(size);
        const write = async () => {
            const writer = stream.writable.getWriter();
            for (const text of texts) await writer.write(bytesOf(text));
            await writer.close();
        };
        const read = async () => {
            let at = 0;
            for (const reader = stream.readable.getReader();;) {
                const { done, value } = await reader.read();
                if (done) break;
                result.set(value, at);
                at += value.length;
            }
            if (at !== size) throw new Error(`${at} bytes instead of ${size}`);
        };
        await Promise.all([write(), read()]);
        return result;
    }

    let halves = null; /* the value of each 16 bit float */
    function halfTable() {
        if (halves) return halves;
        halves = new Float32Array(65536);
        for (let i = 0; i < 65536; i++) {
            const exponent = i >> 10 & 31, mantissa = i & 1023;
            const size = exponent === 31 ? (mantissa ? NaN : Infinity)
                : exponent === 0 ? mantissa * 2 ** -24 : (1024 + mantissa) * 2 ** (exponent - 25);
            halves[i] = i & 0x8000 ? -size : size;
        }
        return halves;
    }

    /* Bytes sorted by significance back to floats. */
    function valuesOf(bytes, half, count) {
        if (half) {
            const table = halfTable(), values = new Float32Array(count);
            for (let i = 0; i < count; i++) values[i] = table[bytes[i] | bytes[count + i] << 8];
            return values;
        }
        const words = new Uint32Array(count), b = count, c = 2 * count, d = 3 * count;
        for (let i = 0; i < count; i++)
            words[i] = bytes[i] | bytes[b + i] << 8 | bytes[c + i] << 16 | bytes[d + i] << 24;
        return new Float32Array(words.buffer);
    }

    /* Channels that stand in the page behind the element `start`, which may still be arriving. */
    class PlaneStore {
        constructor(start, onRecord) {
            this.last = start;         /* the last element that was seen whole */
            this.onRecord = onRecord;  /* called with each element that is no piece of a channel */
            this.planes = new Map();
            this.observer = new MutationObserver(() => this.scan());
            this.observer.observe(start.parentNode, { childList: true });
            document.addEventListener("DOMContentLoaded", () => { this.scan(); this.observer.disconnect(); });
        }
        entry(name) {
            if (!this.planes.has(name)) {
                const entry = { pieces: [] };
                entry.complete = new Promise((resolve) => { entry.resolve = resolve; });
                this.planes.set(name, entry);
            }
            return this.planes.get(name);
        }
        /* An element is whole once something follows it. */
        scan() {
            const loaded = document.readyState !== "loading";
            for (let next; (next = this.last.nextElementSibling) && (next.nextSibling || loaded); this.last = next) {
                if (!("plane" in next.dataset)) { this.onRecord(next); continue; }
                const entry = this.entry(next.dataset.plane);
                entry.pieces.push(next);
                if ("end" in next.dataset) entry.resolve();
            }
        }
        /* The channel's values, once they have arrived. With `once` its text is let go: half of the memory. */
        async read(name, half, count, once) {
            const entry = this.entry(name);
            await entry.complete;
            const bytes = await inflate(entry.pieces.map((piece) => piece.textContent), count * (half ? 2 : 4));
            if (once) for (const piece of entry.pieces) piece.textContent = "";
            return valuesOf(bytes, half, count);
        }
    }

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

    return { PlaneStore, Panes, Picture, toneCurves, toneTable, paintColor, colorMaps, colorTable, paintScalar, placeIn,
        drawScale, contextOf, cssColor, format, digitsOf };
})();
