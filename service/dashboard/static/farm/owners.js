// Who uses the farm: what the stored jobs of each owner took.
import { bytes, count, duration } from "../shared/format.js";
import { html } from "../shared/html.js";
import { useOwners } from "./use_farm.js";

export function Owners() {
  const { value, fault } = useOwners();
  return html`
    <section aria-labelledby="owners-title">
      <h2 id="owners-title">Who uses it <span class="quiet">by the jobs that are stored</span></h2>
      ${fault && html`<p class="fault" role="alert">${fault}</p>`}
      ${
        value &&
        !value.items.length &&
        html`
        <p class="quiet">No jobs yet. <a href="#/new">Submit the first one.</a></p>
      `
      }
      ${
        value?.items.length > 0 &&
        html`
        <div class="table" role="region" aria-label="Table of who uses it" tabindex="0"><table>
          <thead><tr>
            <th scope="col">Key</th><th scope="col">Owner</th><th scope="col" class="number">CPU time</th>
            <th scope="col" class="number">Frames</th><th scope="col" class="number">Stored</th>
            <th scope="col" class="number">Jobs</th><th scope="col" class="number">Open</th>
            <th scope="col" class="number">Running tasks</th>
          </tr></thead>
          <tbody>
            ${value.items.map(
              (item) => html`
              <tr key=${`${item.owner_id} ${item.name}`}>
                <th scope="row">${item.name}</th>
                <td class="quiet">${item.owner_id}</td>
                <td class="number">${duration(item.cpu_s)}</td>
                <td class="number">${count(item.frames_done)}</td>
                <td class="number">${bytes(item.artifact_bytes)}</td>
                <td class="number">${count(item.jobs)}</td>
                <td class="number">${count(item.open_jobs)}</td>
                <td class="number">${count(item.running_tasks)}</td>
              </tr>
            `,
            )}
          </tbody>
        </table></div>
      `
      }
    </section>
  `;
}
