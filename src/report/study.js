/* The page of `caustica study`: shows a subject two images for some seconds, asks, keeps and exports the answers. */
"use strict";

(() => {
    const { Picture, toneTable, paintColor, element } = Caustica, { PlaneStore } = CausticaLayers;
    const study = JSON.parse(element("data").textContent);
    const two = study.screens === 2;
    const toleranceMs = 50; /* as CA_STUDY_TOLERANCE_MS of src/cli/study_answers.h */
    const tell = (id, text) => { element(id).textContent = text; };

    /* ---- Answers, kept in the browser --------------------------------------------------------------------------------- */

    const storageKey = `caustica-study-${study.id}`;
    let sessions = [], stored = true;
    function load() {
        try {
            sessions = JSON.parse(localStorage.getItem(storageKey) || "[]");
        } catch (problem) {
            stored = false;
        }
    }
    function keep() {
        try {
            localStorage.setItem(storageKey, JSON.stringify(sessions));
        } catch (problem) {
            stored = false;
        }
        showKept();
    }
    function showKept() {
        const done = sessions.filter((session) => session.finished).length, open = sessions.length - done;
        tell("kept", `Answers of ${done} subject${done === 1 ? "" : "s"} in this browser${open ? `, ${open} not finished` : ""}.`);
        element("export").disabled = element("clear").disabled = sessions.length === 0;
        element("warning").hidden = stored;
        if (!stored) tell("warning", "This browser keeps no answers: save them before this page is closed.");
    }

    const answers = () => JSON.stringify({ format: "caustica study answers", version: 1, exported: new Date().toISOString(),
        study, sessions }, null, 1) + "\n";

    function exportAnswers() {
        const link = document.createElement("a");
        link.href = URL.createObjectURL(new Blob([answers()], { type: "application/json" }));
        link.download = `answers-${new Date().toISOString().replace(/[:.]/g, "-")}.json`;
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    }

    /* ---- Images ------------------------------------------------------------------------------------------------------- */

    const pictures = []; /* by number in the page: of each scenario its reference, its image */
    const pair = (name) => {
        const number = study.scenarios.findIndex((scenario) => scenario.name === name);
        return { reference: pictures[2 * number], image: pictures[2 * number + 1] };
    };
    async function readPicture(script) {
        const record = JSON.parse(script.textContent), number = Number(script.dataset.image);
        const planes = await Promise.all(record.planes.map((plane, i) => (plane.kind === "color"
            ? store.read(`${number}-${i}`, plane.half, record.width * record.height, true) : null)));
        const picture = new Picture(record.width, record.height), table = toneTable(study.exposure, "sRGB");
        picture.update((pixels) => paintColor(planes.filter((plane) => plane), table, pixels));
        pictures[number] = picture;
    }

    /* ---- Where images are shown ---------------------------------------------------------------------------------------- */

    /* A place for an image in each of the windows, or two in this one. A pixel of the image is `magnify` pixels of the
     * screen on a side, never resampled. */
    let places = [], second = null;
    const isSecondOpen = () => second !== null && !second.closed;
    function makePlace(root) {
        const canvas = root.ownerDocument.createElement("canvas");
        canvas.className = "picture";
        canvas.style.visibility = "hidden";
        root.append(canvas);
        return canvas;
    }
    function openSecond() {
        if (!isSecondOpen()) second = window.open("", "_blank", `popup,left=${screen.width},top=0,width=${innerWidth},height=${innerHeight}`);
        if (!second) { complain("The browser refused to open a second window: allow pop-ups for this page."); return; }
        const body = second.document.body;
        second.document.title = study.title;
        Object.assign(body.style, { margin: "0", height: "100vh", background: "#161616", overflow: "hidden", display: "flex",
            alignItems: "center", justifyContent: "center" });
        body.textContent = "";
        complain("");
    }
    function layPlaces() {
        element("pictures").textContent = "";
        if (isSecondOpen()) second.document.body.textContent = "";
        places = [makePlace(element("pictures")), makePlace(two ? second.document.body : element("pictures"))];
    }
    /* One pixel of the canvas is one of the screen. */
    function draw(canvas, picture) {
        const { width, height } = picture.canvas, ratio = canvas.ownerDocument.defaultView.devicePixelRatio;
        canvas.width = width * study.magnify;
        canvas.height = height * study.magnify;
        canvas.style.width = `${canvas.width / ratio}px`;
        canvas.style.height = `${canvas.height / ratio}px`;
        canvas.style.imageRendering = "pixelated";
        const context = canvas.getContext("2d");
        context.imageSmoothingEnabled = false;
        context.drawImage(picture.canvas, 0, 0, canvas.width, canvas.height);
    }
    /* What is missing for an image to fit, or "". */
    function lackOfRoom() {
        const gap = 24, { width, height } = pictures[0].canvas;
        for (const view of two ? [window, second] : [window]) {
            const side = two ? 1 : 2, wide = (side * width * study.magnify) / view.devicePixelRatio + (side - 1) * gap;
            const high = (height * study.magnify) / view.devicePixelRatio;
            if (view.innerWidth < wide || view.innerHeight < high)
                return `The ${view === window ? "" : "second "}window has ${view.innerWidth} x ${view.innerHeight} pixels; ` +
                    `the images need ${Math.ceil(wide)} x ${Math.ceil(high)}.`;
        }
        return "";
    }

    /* ---- Showing for a time --------------------------------------------------------------------------------------------- */

    const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));

    /* Resolves to how long the images were there, from the frame that brought them to the one that took them away; and what
     * disturbed that. What a frame changes is seen when it is shown, so times of frames are what counts. A window that is
     * hidden has no frames: a timer then takes the images away. */
    async function show(milliseconds) {
        let disturbed = "";
        const disturb = (what) => { disturbed = disturbed || what; };
        const onHide = () => { if (document.hidden) disturb("the window was hidden"); };
        document.addEventListener("visibilitychange", onHide);
        await frame();
        const start = await frame();
        const started = performance.now();
        for (const place of places) place.style.visibility = "visible";
        const end = await new Promise((resolve) => {
            let last = start, longest = 0;
            const timer = setTimeout(() => resolve(start + performance.now() - started), milliseconds + toleranceMs / 2);
            const step = (now) => {
                if (two && !isSecondOpen()) disturb("the second window was closed");
                longest = Math.max(longest, now - last);
                last = now;
                /* The frame that is nearest to the end. */
                if (now - start < milliseconds - Math.min(longest, 20) / 2) { requestAnimationFrame(step); return; }
                clearTimeout(timer);
                resolve(now);
            };
            requestAnimationFrame(step);
        });
        for (const place of places) place.style.visibility = "hidden";
        document.removeEventListener("visibilitychange", onHide);
        if (Math.abs(end - start - milliseconds) > toleranceMs) disturb("the time was not kept");
        return { shown: end - start, disturbed };
    }

    /* ---- A session -------------------------------------------------------------------------------------------------------- */

    const random = () => crypto.getRandomValues(new Uint32Array(1))[0] / 2 ** 32;
    function shuffle(list) {
        for (let i = list.length - 1; i > 0; i--) {
            const k = Math.floor(random() * (i + 1));
            [list[i], list[k]] = [list[k], list[i]];
        }
        return list;
    }
    const describeWindow = (view) => ({ x: view.screenX, y: view.screenY, width: view.innerWidth, height: view.innerHeight,
        screen_width: view.screen.width, screen_height: view.screen.height, device_pixel_ratio: view.devicePixelRatio });

    function newSession(subject) {
        const id = [...crypto.getRandomValues(new Uint8Array(12))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
        return { subject, session: id, started: new Date().toISOString(), order: shuffle(study.scenarios.map((each) => each.name)),
            trials: [], finished: false };
    }

    let session = null; /* at work */
    function card(name) {
        for (const id of ["ready", "asking", "thanks"]) element(id).hidden = id !== name;
        const button = name && element(name).querySelector("button");
        if (name && name !== "asking") button.focus(); /* no answer is nearer than the other */
        else if (document.activeElement) document.activeElement.blur();
    }
    function complain(text) { tell("problem", text); }

    const positive = (id) => { const value = Number(element(id).value.replace(",", ".")); return value > 0 ? value : null; };
    /* What must be put right before a session, or "". */
    function missing() {
        if (!element("subject").value.trim()) return "Which subject is it?";
        if (positive("distance") === null) return "The viewing distance must be a number above 0.";
        if (two && positive("spacing") === null) return "The distance of the monitors must be a number above 0.";
        if (two && !isSecondOpen()) return "The second window is not open.";
        const subject = element("subject").value.trim();
        if (sessions.some((each) => each.subject === subject && each.finished)) return `Subject ${subject} has taken part already.`;
        return lackOfRoom();
    }
    function start() {
        const problem = missing();
        complain(problem);
        if (problem) return;
        const subject = element("subject").value.trim();
        session = sessions.find((each) => each.subject === subject);
        if (!session) {
            session = newSession(subject);
            sessions.push(session);
        }
        Object.assign(session, { screens: study.screens, viewing_distance_m: positive("distance"),
            monitor_spacing_m: two ? positive("spacing") : null,
            display: { windows: (two ? [window, second] : [window]).map(describeWindow), browser: navigator.userAgent } });
        keep();
        element("setup").hidden = true;
        element("stage").hidden = false;
        layPlaces();
        ready();
    }
    /* The next scenario, or the end. */
    function ready() {
        if (session.trials.length === session.order.length) {
            session.finished = true;
            keep();
            card("thanks");
            return;
        }
        tell("ready-text", `${session.trials.length + 1} of ${session.order.length}. Two images will be shown for ` +
            `${study.seconds} seconds${two ? ", one on each monitor" : ""}. Look at both of them.`);
        card("ready");
    }
    let trial = null;
    async function runTrial() {
        if (two && !isSecondOpen()) { back("The second window was closed. Open it and start again: the session goes on."); return; }
        const scenario = session.order[session.trials.length], { reference, image } = pair(scenario);
        const side = study.sides === "random" && random() < 0.5 ? "right" : "left";
        draw(places[0], side === "left" ? reference : image);
        draw(places[1], side === "left" ? image : reference);
        card("");
        const { shown, disturbed } = await show(1000 * study.seconds);
        trial = { scenario, reference_side: side, shown_ms: Math.round(1000 * shown) / 1000, disturbed };
        card("asking");
        trial.asked = performance.now();
    }
    function answer(difference) {
        if (!trial) return;
        const { asked, ...record } = trial;
        trial = null;
        session.trials.push({ ...record, difference, answer_ms: Math.round(performance.now() - asked) });
        keep();
        ready();
    }
    function back(problem) {
        session = null;
        card("");
        element("stage").hidden = true;
        element("setup").hidden = false;
        element("subject").value = "";
        complain(problem || "");
        element("subject").focus();
    }

    /* ---- The start ---------------------------------------------------------------------------------------------------------- */

    tell("title", study.title);
    const samples = study.image.spp;
    tell("plan", `${study.scenarios.length} pairs of a reference and an image of ${samples} sample${samples === 1 ? "" : "s"} per pixel, ` +
        `each shown for ${study.seconds} s ${two ? "on two monitors" : "side by side"}, in random order. A pixel of an image is ` +
        `${study.magnify} x ${study.magnify} of the screen.`);
    tell("question", study.question);
    tell("yes", study.yes);
    tell("no", study.no);
    element("distance").value = String(study.viewing_distance_m);
    element("spacing").value = String(study.monitor_spacing_m);
    for (const each of document.querySelectorAll(".for-two")) each.hidden = !two;
    const onClick = (id, action) => element(id).addEventListener("click", action);
    onClick("second", openSecond);
    onClick("start", start);
    onClick("show", runTrial);
    onClick("yes", () => answer(true));
    onClick("no", () => answer(false));
    onClick("next", () => back());
    onClick("export", exportAnswers);
    let sure = false;
    onClick("clear", () => {
        if (sure) { sessions = []; keep(); }
        sure = !sure;
        tell("clear", sure ? "really delete them?" : "delete answers");
    });
    window.addEventListener("pagehide", () => { if (isSecondOpen()) second.close(); });
    load();
    showKept();

    const reading = [];
    const store = new PlaneStore(document.currentScript, (record) => {
        if ("image" in record.dataset) reading.push(readPicture(record));
    });
    document.addEventListener("DOMContentLoaded", async () => {
        try {
            store.scan();
            await Promise.all(reading);
        } catch (problem) {
            complain(`The images cannot be read: ${problem.message}`);
            return;
        }
        tell("start", "start");
        element("start").disabled = false;
        performance.mark("ready");
    });
})();
