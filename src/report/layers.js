/* The images of a page and their layers: channels out of the page's text, as they are in the files, and what is made of them, of one
 * image or of it and the reference. Ranges are of all images together. Nothing here is drawn. */
"use strict";

const CausticaLayers = (() => {
    const { format, findRange, logRange } = Caustica;

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

    /* ---- Images ----------------------------------------------------------------------------------------------------- */

    /* Channels that every pixel under the pointer asks for. */
    const asked = /^(color|error|below|above):|:Confidence/;
    const channels = ["R", "G", "B"], colorNames = channels.map((c) => `color:${c}`), errorNames = channels.map((c) => `error:${c}`);
    const previewNames = channels.map((c) => `preview:${c}`);
    const mean3 = (a, b, c) => (a + b + c) / 3;

    class PageImage {
        constructor(record, store) {
            Object.assign(this, record); /* name, reference, width, height, metrics */
            this.planes = new Map(record.planes.map((plane, i) => [`${plane.kind}:${plane.name}`,
                { id: `${record.number}-${i}`, bits: plane.bits, half: plane.half, values: null, reading: null }]));
            this.store = store;
            this.picture = null;
            this.painted = "";          /* what the picture shows */
            this.scalar = { layer: "", values: null };
        }
        has(name) { return this.planes.has(name); }
        /* Colours and errors are kept, as every pixel under the pointer asks for them; other channels by their layer only. */
        async values(name) {
            const plane = this.planes.get(name);
            const kept = /^preview:/.test(name) || asked.test(name);
            if (plane.values) return plane.values;
            const [width, height] = name.startsWith("preview:") ? this.preview : [this.width, this.height];
            if (!plane.reading) plane.reading = this.store.read(plane.id, plane.half, width * height, kept);
            const values = await plane.reading;
            plane.reading = null;
            if (kept) plane.values = values;
            return values;
        }
        ready(name) { const plane = this.planes.get(name); return plane ? plane.values : null; }
    }

    const referenceOf = (images) => images.find((image) => image.reference);

    /* ---- Layers ----------------------------------------------------------------------------------------------------- */

    /* A value a pixel made of channels of the image (a) and of the reference (b). */
    const derived = [
        { key: "luminance", label: "luminance", a: colorNames, at: (a) => 0.2126 * a[0] + 0.7152 * a[1] + 0.0722 * a[2],
            what: "0.2126 R + 0.7152 G + 0.0722 B" },
        { key: "signed", label: "difference of luminance", a: colorNames, b: colorNames, signed: true,
            at: (a, b) => 0.2126 * (a[0] - b[0]) + 0.7152 * (a[1] - b[1]) + 0.0722 * (a[2] - b[2]),
            what: "luminance of the image less that of the reference" },
        { key: "absolute", label: "absolute difference", a: colorNames, b: colorNames,
            at: (a, b) => mean3(Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1]), Math.abs(a[2] - b[2])),
            what: "|A − B|, mean of R G B" },
        { key: "relative", label: "relative squared difference", a: colorNames, b: colorNames,
            at: (a, b) => mean3(...[0, 1, 2].map((c) => (a[c] - b[c]) ** 2 / (b[c] ** 2 + 0.01))),
            what: "(A − B)² / (B² + 0.01), mean of R G B" },
        { key: "error", label: "standard error", a: errorNames, at: (a) => mean3(a[0], a[1], a[2]),
            what: "standard error of the pixel, mean of R G B" },
        { key: "deviation", label: "difference / standard error", a: [...colorNames, ...errorNames], b: colorNames,
            b2: errorNames, at: (a, b) => Math.sqrt(mean3(...[0, 1, 2].map((c) =>
                (a[c] - b[c]) ** 2 / (a[3 + c] ** 2 + (b.length > 3 ? b[3 + c] ** 2 : 0))))),
            what: "difference over its standard error, r.m.s. of R G B: about 1 where only noise differs" },
    ];

    /* Of "Albedo.R", "Albedo.G", "Albedo.B" also the colour "Albedo". */
    function colorGroups(names) {
        const groups = new Set(names.filter((name) => name.endsWith(".R")).map((name) => name.slice(0, -2)));
        return [...groups].filter((group) => channels.every((c) => names.includes(`${group}.${c}`)));
    }

    /* All layers that some image has, maps before channels. */
    function layersOf(images) {
        const found = (kind) => [...new Set(images.flatMap((image) => [...image.planes.keys()]))]
            .filter((name) => name.startsWith(kind)).map((name) => name.slice(kind.length));
        const has = (names) => images.some((image) => names.every((name) => image.has(name)));
        const list = [{ key: "color", label: "R G B", planes: colorNames, color: true, what: "linear Rec. 709 radiance" }];
        for (const entry of derived)
            if (has(entry.a) && (!entry.b || referenceOf(images))) list.push({ ...entry, bits: entry.key === "error" ? 8 : 20 });
        for (const name of found("map:"))
            list.push({ key: `map:${name}`, label: name, a: [`map:${name}`], at: (a) => a[0], bits: 12,
                fixed: /FLIP|SSIM/i.test(name) ? [0, 1] : null, what: `${name}, of the image against the reference` });
        const names = found("layer:");
        for (const group of colorGroups(names))
            list.push({ key: `group:${group}`, label: `${group} (R G B)`, planes: channels.map((c) => `layer:${group}.${c}`),
                color: true, what: `layers ${group}.R, .G, .B as colour` });
        for (const name of names)
            list.push({ key: `layer:${name}`, label: name, a: [`layer:${name}`], at: (a) => a[0], bits: 16, what: `layer ${name}` });
        return list;
    }
    const hasLayer = (image, entry) => (entry.planes || entry.a).every((name) => image.has(name)) && !(entry.b && image.reference);

    /* The layer's value of every pixel, or null where the image does not have what it needs. base: the reference. */
    async function scalarOf(image, entry, base) {
        if (image.scalar.layer === entry.key) return image.scalar.values;
        if (!hasLayer(image, entry)) return null;
        const a = await Promise.all(entry.a.map((name) => image.values(name)));
        let b = entry.b ? await Promise.all(entry.b.map((name) => base.values(name))) : [];
        if (entry.b2 && entry.b2.every((name) => base.has(name)))
            b = [...b, ...await Promise.all(entry.b2.map((name) => base.values(name)))];
        let values = a[0];
        if (entry.a.length > 1) {
            values = new Float32Array(image.width * image.height);
            const at = new Array(a.length), bt = new Array(b.length);
            for (let i = 0; i < values.length; i++) {
                for (let k = 0; k < a.length; k++) at[k] = a[k][i];
                for (let k = 0; k < b.length; k++) bt[k] = b[k][i];
                values[i] = entry.at(at, bt);
            }
        }
        image.scalar = { layer: entry.key, values };
        return values;
    }

    /* ---- Ranges ----------------------------------------------------------------------------------------------------- */

    /* What there is of the layer so far. */
    const scalarsOf = (images, entry) => images.filter((image) => image.scalar.layer === entry.key).map((image) => image.scalar.values);

    /* `fixed` or what is found. */
    function shownRange(images, entry, fixed, logarithmic) {
        const range = fixed || (entry.fixed ? { low: entry.fixed[0], high: entry.fixed[1] }
            : findRange(scalarsOf(images, entry), entry.signed));
        return logarithmic && !entry.signed ? logRange(range) : { ...range, log: false };
    }

    /* ---- Values and their errors ------------------------------------------------------------------------------------ */

    /* Of one channel, or of luminance: value, standard error, 95 % interval; null for what is not known. */
    function colorAt(image, c, at) {
        const values = c === "Y" ? null : image.ready(`color:${c}`), errors = image.ready(`error:${c}`);
        const low = image.ready(`layer:ConfidenceLow.${c}`), high = image.ready(`layer:ConfidenceHigh.${c}`);
        const below = image.ready(`below:${c}`), above = image.ready(`above:${c}`);
        const rgb = colorNames.map((name) => image.ready(name));
        if (!rgb[0]) return null;
        const value = values ? values[at] : 0.2126 * rgb[0][at] + 0.7152 * rgb[1][at] + 0.0722 * rgb[2][at];
        const error = errors && Number.isFinite(errors[at]) ? errors[at] : null;
        const interval = below && above ? [value - below[at], value + above[at]] : low && high ? [low[at], high[at]]
            : error !== null ? [value - 1.959964 * error, value + 1.959964 * error] : null;
        return { value, error, interval };
    }
    /* An interval from -inf to inf is the renderer's word for a pixel whose samples cannot tell. */
    const isKnown = (interval) => interval.every(Number.isFinite);
    const errorText = (found) => (found.error !== null ? `±${format(found.error, 2)}` : !found.interval ? ""
        : isKnown(found.interval) ? `${format(found.interval[0], 4)}…${format(found.interval[1], 4)}` : "unknown");

    return { PlaneStore, PageImage, referenceOf, asked, channels, colorNames, previewNames, layersOf, hasLayer, scalarOf, scalarsOf,
        shownRange, colorAt, isKnown, errorText };
})();
