// The viewer of a job: the newest frame, or the chosen one, as a picture that moves.
import { useRef, useState } from "preact/hooks";
import { pictureUrl } from "../api/operations.js";
import { Choice } from "../shared/choice.js";
import { count } from "../shared/format.js";
import { html } from "../shared/html.js";
import { isExact } from "./painting/atlases.js";
import { GRAPHICS } from "./painting/canvas.js";
import { Empty } from "./empty.js";
import { useCast } from "./cast/use_cast.js";
import { pressed } from "./hand/keys.js";
import { MODES, TITLES } from "./modes/index.js";
import { FilmStrip } from "./time/film_strip.js";
import { useRecorder } from "./record.js";
import { Save } from "./save.js";
import { Screen } from "./screen.js";
import { TimeBar } from "./time/time_bar.js";
import { useAtlas, useAtlases } from "./painting/use_atlas.js";
import { useFrames } from "./time/use_frames.js";
import { usePlayer } from "./time/use_player.js";
import { useGuide } from "./depth/use_guide.js";
import { useStand } from "./use_stand.js";
import { useFullScreen, useMotionPreference, useSize } from "./use_screen.js";
import { useTilt } from "./hand/use_tilt.js";
import { homeOf } from "./painting/views.js";
import { FIT } from "./hand/zoom.js";

const PAN_STEP = 0.1;

export function Looker({ job }) {
  const frames = useFrames(job);
  const atlases = useAtlases(job);
  if (!frames.numbers.length) return html`<${Empty} job=${job} />`;
  return html`<${Look} key=${job.id} job=${job} frames=${frames} atlases=${atlases} />`;
}

function Look({ job, frames, atlases }) {
  const { stand, change } = useStand(job.id);
  const [graphics, setGraphics] = useState(GRAPHICS.there);
  const [isSteered, setSteered] = useState(false); // The hand has moved the eye.
  const [held, hold] = useState(null); // The frame under the pointer stays, though newer ones are done.
  const [pictureSize, setPictureSize] = useState(null);
  const box = useRef(null);
  const hand = useRef(null);
  const busy = useRef(false);
  const room = useSize(box, ".stage");
  const full = useFullScreen(box);
  const isCalm = useMotionPreference();

  const { numbers } = frames;
  const frame = stand.frame ?? stand.aim?.frame ?? held ?? numbers.at(-1);
  const places = frames.around(frame);
  const { at: index, before, after } = places;
  const item = index < 0 ? null : frames.itemOf(frame);
  const openStatus = frames.openStatus(frame);
  const kind = MODES[stand.mode];
  const wantsWhole = Boolean(kind.needsAll || stand.place || !stand.isSmooth || isSteered);
  const player = usePlayer({
    index: index < 0 ? before : index,
    count: numbers.length,
    show: (place) => change({ frame: numbers[place] }),
    isReady: (place) => (isPainted ? atlases.isLoaded(numbers[place], "first") : !busy.current),
    prepare: (place) => isPainted && atlases.get(numbers[place], "first").catch(() => {}),
  });
  const mayPaint = graphics === GRAPHICS.there && Boolean(kind.paint);
  const found = useAtlas(atlases, openStatus ? null : frame, {
    isPainted: mayPaint,
    wantsWhole: wantsWhole && !player.isPlaying,
  });
  const { frameViews } = found;
  const { guide, isWaiting } = useGuide(found.atlas, Boolean(kind.movesEye && wantsWhole && !player.isPlaying));
  const isPainted = mayPaint && !(kind.needsAll && frameViews && !isExact(frameViews));
  const views = frameViews ?? found.atlas?.frameViews ?? null;
  const viewSize = views && { width: views.view_cols, height: views.view_rows };
  const home = views ? homeOf(views, (isPainted && found.atlas?.frameViews.atlas) || views.atlas) : { x: 0, y: 0 };
  const filled = views && kind.filled(views, { ...stand, place: stand.place ?? home });
  const given = {
    job: job.id,
    frame,
    frameViews: views,
    stand: { ...(filled ?? stand), place: stand.place },
    change,
    isPainted,
    size: kind.paint ? viewSize : pictureSize,
    room,
    home,
    absence: openStatus && `Frame ${frame} is ${openStatus}.`,
  };
  // The modes that do not paint see a place, too.
  const asked = views && { ...given, stand: filled };
  const [what, query] = (asked && kind.query?.(asked)) ?? [];
  const url = what && pictureUrl(job.id, frame, what, query);
  const label = `Frame ${frame}, ${openStatus || kind.name}`;

  const canvas = () => hand.current?.stage?.querySelector("canvas:not(.empty)");
  const recorder = useRecorder(canvas, `${job.id}-${frame}`);
  const cast = useCast(job, openStatus ? null : frame, atlases);
  const tilt = useTilt((place) => hand.current?.tilt(place));
  const toggleTilt = () => {
    if (!tilt.isOn) change({ place: null });
    tilt.toggle();
  };

  const show = (place) => {
    if (numbers[place] === undefined) return;
    player.pause();
    change({ frame: numbers[place] });
  };
  const choose = (mode) => mode !== stand.mode && change({ mode, zoom: FIT }, { isStep: true });
  const turned = (direction) => direction.map((each) => -PAN_STEP * each);
  const step = (direction) => {
    if (!views || !kind.stepped) return hand.current.pan(...turned(direction));
    const from = isPainted && kind.movesEye ? { ...asked, stand: { ...filled, place: hand.current.place() } } : asked;
    return change(kind.stepped(from, direction));
  };
  const press = pressed({
    step,
    pan: (direction) => hand.current.pan(...turned(direction)),
    zoom: (factor) => hand.current.zoom(factor),
    fit: () => change({ zoom: FIT }),
    show: { before: () => show(before), after: () => show(after) },
    toggle: { fullScreen: full.toggle, play: player.toggle },
    modes: Object.keys(MODES).map((mode) => () => choose(mode)),
  });
  const said = openStatus || (asked && kind.said({ ...asked, isFree: stand.place === null }));
  const fault = openStatus ? "" : found.fault;
  return html`
    <section ref=${box} class="looker ${full.isOn ? "full" : ""}" aria-label="Picture" onKeyDown=${press}
      onPointerEnter=${() => hold(frame)} onPointerLeave=${() => hold(null)}>
      <div class="bar">
        <${Choice} name="Mode" choices=${TITLES} chosen=${stand.mode} choose=${choose} />
        <span class="ends">
          <${Save}
            url=${url}
            what=${what}
            isPair=${stand.eyes !== "one" && what === "observer"}
            item=${item}
            name="${job.id}-${frame}"
            sheet=${kind.Picture ? stand.sheet : null}
            canvas=${canvas}
            recorder=${isPainted && recorder.isOffered ? recorder : null}
          />
          ${recorder.isOn && html`<button class="danger" onClick=${recorder.toggle}>Stop recording</button>`}
          ${
            cast.isOffered &&
            html`
              <button class="toggle" aria-pressed=${cast.isOn} onClick=${cast.toggle}
                title="Shows this frame on a Looking Glass panel.">Cast</button>
            `
          }
          <button onClick=${full.toggle} aria-pressed=${full.isOn} title="Key F">Full screen</button>
        </span>
      </div>
      <${Screen}
        given=${{ ...given, stand: isPainted && kind.movesEye ? given.stand : (filled ?? stand) }}
        kind=${kind}
        item=${item}
        url=${url}
        label=${label}
        atlas=${isPainted ? found.atlas : null}
        guide=${guide}
        isWaiting=${found.isWaiting || isWaiting}
        isCalm=${isCalm}
        isFull=${full.isOn}
        isRecorded=${recorder.isOn}
        hand=${hand}
        onSteer=${() => isSteered || setSteered(true)}
        busy=${busy}
        graphics=${graphics}
        onGraphics=${setGraphics}
        onSize=${setPictureSize}
      />
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${cast.fault && html`<p class="fault" role="alert">${cast.fault}</p>`}
      ${cast.isOffered && html`<p class="cast" role="status" aria-label="Panel">${cast.said}</p>`}
      <${TimeBar}
        frames=${numbers}
        places=${places}
        show=${show}
        player=${player}
        isSequence=${job.frames_total > 1}
      />
      ${job.frames_total > 1 && html`<${FilmStrip} frames=${frames} frame=${frame} places=${places} show=${show} />`}
      <div class="bar controls" data-mode=${stand.mode}>
        ${
          asked &&
          html`
            <${kind.Controls} ...${asked} isFree=${stand.place === null} hold=${() => hand.current.place()} />
          `
        }
        ${
          isPainted &&
          kind.movesEye &&
          tilt.isOffered &&
          html`<button class="toggle" aria-pressed=${tilt.isOn} onClick=${toggleTilt}>Tilt</button>`
        }
        ${
          stand.zoom.scale !== 1 &&
          html`
            <button onClick=${() => change({ zoom: FIT })}>${count(Math.round(100 * stand.zoom.scale))} %, fit</button>
          `
        }
        <p class="said">
          <span id="look-hint" class="quiet">${kind.hint}</span>
          <span class="numbers" aria-live=${player.isPlaying ? "off" : "polite"}>
            Frame ${frame}${said && ` · ${said}`}
          </span>
        </p>
      </div>
    </section>
  `;
}
