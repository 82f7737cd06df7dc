BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('0002');
CREATE TABLE clerk (
	id INTEGER NOT NULL, 
	leader VARCHAR(100), 
	until_s DOUBLE NOT NULL, 
	position VARCHAR(64) NOT NULL, 
	idle_s DOUBLE NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO "clerk" VALUES(1,'vm-10503-6a5366',1.79591000532422780987e+09,'1795909997403-0',2.50162773132324218745e+01);
CREATE TABLE credentials (
	id VARCHAR(32) NOT NULL, 
	kind VARCHAR(16) NOT NULL, 
	name VARCHAR(100) NOT NULL, 
	role VARCHAR(16) NOT NULL, 
	secret_sha256 VARCHAR(64) NOT NULL, 
	parent VARCHAR(32), 
	created_s DOUBLE NOT NULL, 
	expires_s DOUBLE, 
	PRIMARY KEY (id)
);
CREATE TABLE idempotency_keys (
	caller VARCHAR(64) NOT NULL, 
	"key" VARCHAR(200) NOT NULL, 
	fingerprint VARCHAR(64) NOT NULL, 
	job_id VARCHAR(32) NOT NULL, 
	created_s DOUBLE NOT NULL, 
	PRIMARY KEY (caller, "key")
);
INSERT INTO "idempotency_keys" VALUES('fb46c131b664','79b27516c7b84a259fb836a63ee2ede7','40a415ef93eb65a9f5b035d79c43e670171947452e1d7440d441ea8214f0b333','1m8j94n5kw1dre9x2',1.79590989944317960735e+09);
CREATE TABLE job_events (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	job_id VARCHAR(32) NOT NULL, 
	topic VARCHAR(16) NOT NULL, 
	data JSON NOT NULL
);
INSERT INTO "job_events" VALUES(1,'1m8j94n5kw1dre9x2','job','{"id": "1m8j94n5kw1dre9x2", "title": "Old midflight fish", "scene": "fish", "status": "queued", "priority": 50, "owner": "admin", "created_at": "2026-11-28T23:51:39.443180Z", "started_at": null, "ended_at": null, "frames": {"count": 6, "text": "1-6"}, "fps": 6.0, "spec": {"scene": "fish", "title": "Old midflight fish", "parameters": {"turn_deg_per_frame": 12, "ripple": 0.5}, "stage": {"location": null, "look_at": null, "up": null, "mm_per_unit": null, "reference_mm": null, "near_mm": null, "far_mm": null}, "clock": null, "frames": "1-6", "fps": 6.0, "rig": {"imaging_lens": "athineos-2006", "f_number": null, "stop_mm": null, "dispersion": false, "lens_array": {"preset": null, "lattice": "square", "count": [20, 20], "pitch_mm": 1.0, "focal_length_mm": 3.3, "index": 1.49, "aperture": "full", "offset_mm": 40.0, "substrate_mm": 0.0}, "camera": {"projection": "orthographic", "angle_deg": 6.738}, "px_per_lens": 4, "device": null}, "capture": {"method": "ray_camera", "supersample": 8, "depth": true}, "render": {"antialias": "off", "tiles": [2, 1], "timeout_s": 21600.0, "stall_s": 600.0, "memory_mb": 8192}, "display": {"gap_real_mm": null, "gap_virtual_mm": null, "viewing_distance_mm": 1000.0}, "priority": 50, "outputs": [{"kind": "views", "name": "views", "codec": "h264", "container": null, "crf": null, "chroma": null, "bits": 8, "scale": null, "filter": "bicubic", "views_per_s": 24.0}, {"kind": "orthoscopic", "name": "orthoscopic", "codec": "ffv1", "container": null, "crf": null, "chroma": null, "bits": 8}, {"kind": "quilt", "name": "quilt", "scale": 4.0, "filter": "lanczos3", "bits": 8, "views": "row", "view_row": null, "count": null, "columns": null, "aspect": null}, {"kind": "depth", "name": "depth", "source": "truth", "file_format": "png", "u": null, "v": null, "method": "tensor", "reach": 2, "farthest_mm": null, "nearest_mm": null}], "animation": {"rig.lens_array.offset_mm": {"keyframes": [[1, 40.0], [6, 10.0]], "interpolation": "smooth"}}}, "notes": ["From frame 1: The array stands in the image space: near parts are shown real, far ones virtual, s from -10.1 mm (far) to +40.0 mm (near)."], "error": null, "progress": 0.0, "eta_s": null, "tasks": {"waiting": 0, "ready": 1, "dispatched": 0, "running": 0, "done": 0, "failed": 0, "cancelled": 0}, "frames_done": 0, "frames_total": 6, "cpu_s": 0.0, "late_events": 0, "outputs": [{"name": "views.mp4", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/video/views.mp4", "ready": false}, {"name": "orthoscopic.mkv", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/video/orthoscopic.mkv", "ready": false}, {"name": "quilt.png", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/exports/quilt.png.json", "ready": false}, {"name": "depth.png", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/exports/depth.png.json", "ready": false}], "size": {"rows": 80, "cols": 80, "lens_rows": 20, "lens_cols": 20, "px_per_lens": 4}}');
INSERT INTO "job_events" VALUES(2,'1m8j94n5kw1dre9x2','job','{"id": "1m8j94n5kw1dre9x2", "title": "Old midflight fish", "scene": "fish", "status": "probing", "priority": 50, "owner": "admin", "created_at": "2026-11-28T23:51:39.443180Z", "started_at": "2026-11-28T23:51:39.616509Z", "ended_at": null, "frames": {"count": 6, "text": "1-6"}, "fps": 6.0, "spec": {"scene": "fish", "title": "Old midflight fish", "parameters": {"turn_deg_per_frame": 12, "ripple": 0.5}, "stage": {"location": null, "look_at": null, "up": null, "mm_per_unit": null, "reference_mm": null, "near_mm": null, "far_mm": null}, "clock": null, "frames": "1-6", "fps": 6.0, "rig": {"imaging_lens": "athineos-2006", "f_number": null, "stop_mm": null, "dispersion": false, "lens_array": {"preset": null, "lattice": "square", "count": [20, 20], "pitch_mm": 1.0, "focal_length_mm": 3.3, "index": 1.49, "aperture": "full", "offset_mm": 40.0, "substrate_mm": 0.0}, "camera": {"projection": "orthographic", "angle_deg": 6.738}, "px_per_lens": 4, "device": null}, "capture": {"method": "ray_camera", "supersample": 8, "depth": true}, "render": {"antialias": "off", "tiles": [2, 1], "timeout_s": 21600.0, "stall_s": 600.0, "memory_mb": 8192}, "display": {"gap_real_mm": null, "gap_virtual_mm": null, "viewing_distance_mm": 1000.0}, "priority": 50, "outputs": [{"kind": "views", "name": "views", "codec": "h264", "container": null, "crf": null, "chroma": null, "bits": 8, "scale": null, "filter": "bicubic", "views_per_s": 24.0}, {"kind": "orthoscopic", "name": "orthoscopic", "codec": "ffv1", "container": null, "crf": null, "chroma": null, "bits": 8}, {"kind": "quilt", "name": "quilt", "scale": 4.0, "filter": "lanczos3", "bits": 8, "views": "row", "view_row": null, "count": null, "columns": null, "aspect": null}, {"kind": "depth", "name": "depth", "source": "truth", "file_format": "png", "u": null, "v": null, "method": "tensor", "reach": 2, "farthest_mm": null, "nearest_mm": null}], "animation": {"rig.lens_array.offset_mm": {"keyframes": [[1, 40.0], [6, 10.0]], "interpolation": "smooth"}}}, "notes": ["From frame 1: The array stands in the image space: near parts are shown real, far ones virtual, s from -10.1 mm (far) to +40.0 mm (near)."], "error": null, "progress": 0.0, "eta_s": null, "tasks": {"waiting": 0, "ready": 1, "dispatched": 0, "running": 0, "done": 0, "failed": 0, "cancelled": 0}, "frames_done": 0, "frames_total": 6, "cpu_s": 0.0, "late_events": 0, "outputs": [{"name": "views.mp4", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/video/views.mp4", "ready": false}, {"name": "orthoscopic.mkv", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/video/orthoscopic.mkv", "ready": false}, {"name": "quilt.png", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/exports/quilt.png.json", "ready": false}, {"name": "depth.png", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/exports/depth.png.json", "ready": false}], "size": {"rows": 80, "cols": 80, "lens_rows": 20, "lens_cols": 20, "px_per_lens": 4}}');
INSERT INTO "job_events" VALUES(9,'1m8j94n5kw1dre9x2','job','{"id": "1m8j94n5kw1dre9x2", "title": "Old midflight fish", "scene": "fish", "status": "running", "priority": 50, "owner": "admin", "created_at": "2026-11-28T23:51:39.443180Z", "started_at": "2026-11-28T23:51:39.616509Z", "ended_at": null, "frames": {"count": 6, "text": "1-6"}, "fps": 6.0, "spec": {"scene": "fish", "title": "Old midflight fish", "parameters": {"turn_deg_per_frame": 12, "ripple": 0.5}, "stage": {"location": null, "look_at": null, "up": null, "mm_per_unit": null, "reference_mm": null, "near_mm": null, "far_mm": null}, "clock": null, "frames": "1-6", "fps": 6.0, "rig": {"imaging_lens": "athineos-2006", "f_number": null, "stop_mm": null, "dispersion": false, "lens_array": {"preset": null, "lattice": "square", "count": [20, 20], "pitch_mm": 1.0, "focal_length_mm": 3.3, "index": 1.49, "aperture": "full", "offset_mm": 40.0, "substrate_mm": 0.0}, "camera": {"projection": "orthographic", "angle_deg": 6.738}, "px_per_lens": 4, "device": null}, "capture": {"method": "ray_camera", "supersample": 8, "depth": true}, "render": {"antialias": "off", "tiles": [2, 1], "timeout_s": 21600.0, "stall_s": 600.0, "memory_mb": 8192}, "display": {"gap_real_mm": null, "gap_virtual_mm": null, "viewing_distance_mm": 1000.0}, "priority": 50, "outputs": [{"kind": "views", "name": "views", "codec": "h264", "container": null, "crf": null, "chroma": null, "bits": 8, "scale": null, "filter": "bicubic", "views_per_s": 24.0}, {"kind": "orthoscopic", "name": "orthoscopic", "codec": "ffv1", "container": null, "crf": null, "chroma": null, "bits": 8}, {"kind": "quilt", "name": "quilt", "scale": 4.0, "filter": "lanczos3", "bits": 8, "views": "row", "view_row": null, "count": null, "columns": null, "aspect": null}, {"kind": "depth", "name": "depth", "source": "truth", "file_format": "png", "u": null, "v": null, "method": "tensor", "reach": 2, "farthest_mm": null, "nearest_mm": null}], "animation": {"rig.lens_array.offset_mm": {"keyframes": [[1, 40.0], [6, 10.0]], "interpolation": "smooth"}}}, "notes": ["From frame 1: The array stands in the image space: near parts are shown real, far ones virtual, s from -10.1 mm (far) to +40.0 mm (near)."], "error": null, "progress": 0.0, "eta_s": null, "tasks": {"waiting": 10, "ready": 12, "dispatched": 0, "running": 0, "done": 1, "failed": 0, "cancelled": 0}, "frames_done": 0, "frames_total": 6, "cpu_s": 0.35626249699999996, "late_events": 0, "outputs": [{"name": "views.mp4", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/video/views.mp4", "ready": false}, {"name": "orthoscopic.mkv", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/video/orthoscopic.mkv", "ready": false}, {"name": "quilt.png", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/exports/quilt.png.json", "ready": false}, {"name": "depth.png", "url": "/api/v1/jobs/1m8j94n5kw1dre9x2/artifacts/exports/depth.png.json", "ready": false}], "size": {"rows": 80, "cols": 80, "lens_rows": 20, "lens_cols": 20, "px_per_lens": 4}}');
INSERT INTO "job_events" VALUES(88,'1m8j94n5kw1dre9x2','task','{"job": "1m8j94n5kw1dre9x2", "id": "1m8j94n5kw1dre9x2-9", "kind": "assemble", "status": "done", "frame": 3, "tile": null, "worker": "vm-10539", "attempt_number": 1}');
INSERT INTO "job_events" VALUES(89,'1m8j94n5kw1dre9x2','frame','{"job": "1m8j94n5kw1dre9x2", "frame": 3, "status": "done"}');
INSERT INTO "job_events" VALUES(90,'1m8j94n5kw1dre9x2','progress','{"id": "1m8j94n5kw1dre9x2", "progress": 0.5615384615384615, "eta_s": null, "tasks": {"waiting": 7, "ready": 4, "dispatched": 1, "running": 0, "done": 11, "failed": 0, "cancelled": 0}, "frames_done": 3, "cpu_s": 21.007064959000004}');
INSERT INTO "job_events" VALUES(91,'1m8j94n5kw1dre9x2','task','{"job": "1m8j94n5kw1dre9x2", "id": "1m8j94n5kw1dre9x2-11", "kind": "render", "status": "running", "frame": 4, "tile": {"row": 1, "col": 0}, "worker": "vm-10539", "attempt_number": 1}');
INSERT INTO "job_events" VALUES(92,'1m8j94n5kw1dre9x2','frame','{"job": "1m8j94n5kw1dre9x2", "frame": 4, "status": "rendering"}');
INSERT INTO "job_events" VALUES(93,'1m8j94n5kw1dre9x2','progress','{"id": "1m8j94n5kw1dre9x2", "progress": 0.5615384615384615, "eta_s": 75.53207015897269, "tasks": {"waiting": 7, "ready": 4, "dispatched": 0, "running": 1, "done": 11, "failed": 0, "cancelled": 0}, "frames_done": 3, "cpu_s": 21.007064959000004}');
INSERT INTO "job_events" VALUES(94,'1m8j94n5kw1dre9x2','task','{"job": "1m8j94n5kw1dre9x2", "id": "1m8j94n5kw1dre9x2-13", "kind": "render", "status": "dispatched", "frame": 5, "tile": {"row": 0, "col": 0}, "worker": null, "attempt_number": 1}');
CREATE TABLE jobs (
	id VARCHAR(32) NOT NULL, 
	title VARCHAR(200) NOT NULL, 
	scene VARCHAR(100) NOT NULL, 
	spec JSON NOT NULL, 
	notes JSON NOT NULL, 
	owner VARCHAR(64) NOT NULL, 
	status VARCHAR(16) NOT NULL, 
	chore VARCHAR(16), 
	priority BIGINT NOT NULL, 
	created_s DOUBLE NOT NULL, 
	started_s DOUBLE, 
	planned_s DOUBLE, 
	ended_s DOUBLE, 
	probe JSON, 
	"plan" JSON, 
	error_code VARCHAR(64), 
	error_message TEXT, 
	waiting BIGINT NOT NULL, 
	ready BIGINT NOT NULL, 
	dispatched BIGINT NOT NULL, 
	running BIGINT NOT NULL, 
	done BIGINT NOT NULL, 
	failed BIGINT NOT NULL, 
	cancelled BIGINT NOT NULL, 
	frames_total BIGINT NOT NULL, 
	frames_done BIGINT NOT NULL, 
	total_px BIGINT NOT NULL, 
	done_px BIGINT NOT NULL, 
	cpu_s DOUBLE NOT NULL, 
	wall_s DOUBLE NOT NULL, 
	late_events BIGINT NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO "jobs" VALUES('1m8j94n5kw1dre9x2','Old midflight fish','fish','{"scene": "fish", "title": "Old midflight fish", "parameters": {"turn_deg_per_frame": 12, "ripple": 0.5}, "stage": {"location": null, "look_at": null, "up": null, "mm_per_unit": null, "reference_mm": null, "near_mm": null, "far_mm": null}, "clock": null, "frames": "1-6", "fps": 6.0, "rig": {"imaging_lens": "athineos-2006", "f_number": null, "stop_mm": null, "dispersion": false, "lens_array": {"preset": null, "lattice": "square", "count": [20, 20], "pitch_mm": 1.0, "focal_length_mm": 3.3, "index": 1.49, "aperture": "full", "offset_mm": 40.0, "substrate_mm": 0.0}, "camera": {"projection": "orthographic", "angle_deg": 6.738}, "px_per_lens": 4, "device": null}, "capture": {"method": "ray_camera", "supersample": 8, "depth": true}, "render": {"antialias": "off", "tiles": [2, 1], "timeout_s": 21600.0, "stall_s": 600.0, "memory_mb": 8192}, "display": {"gap_real_mm": null, "gap_virtual_mm": null, "viewing_distance_mm": 1000.0}, "priority": 50, "outputs": [{"kind": "views", "name": "views", "codec": "h264", "container": null, "crf": null, "chroma": null, "bits": 8, "scale": null, "filter": "bicubic", "views_per_s": 24.0}, {"kind": "orthoscopic", "name": "orthoscopic", "codec": "ffv1", "container": null, "crf": null, "chroma": null, "bits": 8}, {"kind": "quilt", "name": "quilt", "scale": 4.0, "filter": "lanczos3", "bits": 8, "views": "row", "view_row": null, "count": null, "columns": null, "aspect": null}, {"kind": "depth", "name": "depth", "source": "truth", "file_format": "png", "u": null, "v": null, "method": "tensor", "reach": 2, "farthest_mm": null, "nearest_mm": null}], "animation": {"rig.lens_array.offset_mm": {"keyframes": [[1, 40.0], [6, 10.0]], "interpolation": "smooth"}}}','["From frame 1: The array stands in the image space: near parts are shown real, far ones virtual, s from -10.1 mm (far) to +40.0 mm (near)."]','admin','running','retry',50,1.79590989944317960735e+09,1.7959098996165087223e+09,1.79590990237844443317e+09,NULL,'{"start_s": 1.7719723929999691, "s_per_px": 0.00094, "tileable": true, "renders": true}','{"tile_rows": 2, "tile_cols": 1, "probe_start_s": 1.7719723929999691, "probe_s_per_px": 0.00094, "renders": true}',NULL,NULL,6,3,1,1,11,1,0,6,3,41600,23360,2.1007064959000004479e+01,9.67340547650001099117e+01,0);
CREATE TABLE scenes (
	name VARCHAR(100) NOT NULL, 
	digest VARCHAR(64) NOT NULL, 
	card JSON NOT NULL, 
	builtin BOOLEAN NOT NULL, 
	poster BLOB, 
	updated_s DOUBLE NOT NULL, 
	PRIMARY KEY (name)
);
INSERT INTO "scenes" VALUES('fish','8221524bf2cf47f3247deb8a95c67d7f7b6621ca18ad5e12e7620dca203e593e','{"file": "scene.inc", "title": "Fish over water", "description": "A striped, image-mapped fish turns in the air over a rippled pond that mirrors it; four bulrushes stand in the water at increasing depths, the last 2500 mm from the lens.", "license": "MIT", "stage": {"location": [0.0, 60.0, -1000.0], "look_at": [0.0, 60.0, 0.0], "up": [0.0, 1.0, 0.0], "mm_per_unit": 1.0, "near_mm": 1000.0, "far_mm": 2500.0, "reference_mm": 1000.0}, "clock": {"first": 0.0, "per_frame": 1.0}, "parameters": {"turn_deg_per_frame": {"type": "number", "default": 8.0, "minimum": -180.0, "maximum": 180.0, "unit": "deg", "description": "Turn of the fish per frame; positive is clockwise as seen from above."}, "base_turn_deg": {"type": "number", "default": -24.0, "minimum": -360.0, "maximum": 360.0, "unit": "deg", "description": "Turn of the fish in the first frame; 0 shows its left flank, head to the left."}, "ripple": {"type": "number", "default": 0.3, "minimum": 0.0, "maximum": 1.5, "unit": "mm", "description": "Height of the ring waves on the water; 0 makes it a plane mirror."}, "water_depth_mm": {"type": "number", "default": 94.0, "minimum": 75.0, "maximum": 200.0, "unit": "mm", "description": "How far the water lies below the fish''s middle; the deeper, the less of the mirrored fish is in the picture."}}, "sheets": null}',1,NULL,1.79590986690966558452e+09);
CREATE TABLE stopped_attempts (
	attempt VARCHAR(32) NOT NULL, 
	at_s DOUBLE NOT NULL, 
	PRIMARY KEY (attempt)
);
INSERT INTO "stopped_attempts" VALUES('00ff00ff00ff00ff00ff00ff',1900000000.0);
CREATE TABLE tasks (
	job_id VARCHAR(32) NOT NULL, 
	sequence BIGINT NOT NULL, 
	kind VARCHAR(16) NOT NULL, 
	stage VARCHAR(32) NOT NULL, 
	needs VARCHAR(32), 
	frame BIGINT, 
	tile_row BIGINT, 
	tile_col BIGINT, 
	output VARCHAR(64), 
	artifact VARCHAR(200) NOT NULL, 
	weight_px BIGINT NOT NULL, 
	status VARCHAR(16) NOT NULL, 
	attempt VARCHAR(32), 
	attempt_number BIGINT NOT NULL, 
	failures BIGINT NOT NULL, 
	failed_on JSON NOT NULL, 
	worker VARCHAR(200), 
	progress DOUBLE, 
	not_before_s DOUBLE, 
	dispatched_s DOUBLE, 
	dispatched_idle_s DOUBLE, 
	claimed_s DOUBLE, 
	beat_s DOUBLE, 
	ended_s DOUBLE, 
	cpu_s DOUBLE, 
	wall_s DOUBLE, 
	error_code VARCHAR(64), 
	error_message TEXT, 
	permanent BOOLEAN NOT NULL, rests BIGINT DEFAULT '0' NOT NULL, 
	PRIMARY KEY (job_id, sequence), 
	FOREIGN KEY(job_id) REFERENCES jobs (id)
);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',0,'probe','probe',NULL,NULL,NULL,NULL,NULL,'',0,'done','bab07e138d751e625bed3985',1,0,'[]','vm-10539',1.0,NULL,1.7959098996165087223e+09,2.50162773132324218745e+01,1.79590989985058760644e+09,1.79590990098750495911e+09,1.79590990233756780621e+09,3.56262496999999955793e-01,2.42352583900003537564e+00,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',1,'render','render/0001',NULL,1,0,0,NULL,'tiles/0001/00-00.exr',3200,'done','647fc4c3bb65f43fce8c801f',1,0,'[]','vm-10539',1.0,NULL,1.79590990249048924444e+09,2.50162773132324218745e+01,1.79590990257880663873e+09,1.79590992415754532808e+09,1.79590992564535403257e+09,4.19125603499999943579e+00,2.30247579699999960212e+01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',2,'render','render/0001',NULL,1,1,0,NULL,'tiles/0001/01-00.exr',3200,'done','9a54988be26143746a1d0afc',1,0,'[]','vm-10539',1.0,NULL,1.79590990249048924444e+09,2.50162773132324218745e+01,1.79590992566557788845e+09,1.79590993688432216642e+09,1.79590993991197443008e+09,3.05566027799999950786e+00,1.42441644670000187034e+01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',3,'assemble','assemble','render/0001',1,NULL,NULL,NULL,'thumbs/0001.webp',320,'done','08b56942c616e710eed3ac77',1,0,'[]','vm-10539',1.0,NULL,1.79590993993261647219e+09,2.50162773132324218745e+01,1.79590995544169545168e+09,1.79590995544169545168e+09,1.79590995574576330184e+09,2.1056312000000021456e-02,2.08642935000057150318e-01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',4,'render','render/0002',NULL,2,0,0,NULL,'tiles/0002/00-00.exr',3200,'done','dbd85804e4990a1192d3ded4',1,0,'[]','vm-10539',1.0,NULL,1.79590992565212345124e+09,2.50162773132324218745e+01,1.79590993994606757159e+09,1.79590995142994523051e+09,1.79590995533953118323e+09,3.37392654300000049971e+00,1.54167904480000288462e+01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',5,'render','render/0002',NULL,2,1,0,NULL,'tiles/0002/01-00.exr',3200,'done','4c798d700bea29a7dbbc1fed',1,0,'[]','vm-10539',1.0,NULL,1.79590995540491604807e+09,2.50162773132324218745e+01,1.79590995586761045452e+09,1.79590996177622485166e+09,1.79590996647266936303e+09,2.54943855099999971969e+00,1.07651354739999760568e+01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',6,'assemble','assemble','render/0002',2,NULL,NULL,NULL,'thumbs/0002.webp',320,'done','f15b5add9255e72b3154accd',1,0,'[]','vm-10539',1.0,NULL,1.79590996650730466838e+09,2.50162773132324218745e+01,1.79590997736051630976e+09,1.79590997736051630976e+09,1.7959099775777385235e+09,1.57622500000000886899e-02,2.23273843000015403958e-01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',7,'render','render/0003',NULL,3,0,0,NULL,'tiles/0003/00-00.exr',3200,'done','3b57abbc39482e0850fb34c5',1,0,'[]','vm-10539',1.0,NULL,1.7959099558324007988e+09,2.50162773132324218745e+01,1.79590996663818097114e+09,1.79590997273582744604e+09,1.79590997733352398871e+09,2.79976608299999973894e+00,1.06902329060000056415e+01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',8,'render','render/0003',NULL,3,1,0,NULL,'tiles/0003/01-00.exr',3200,'done','6627ffc6e28735c9f28f50f8',1,0,'[]','vm-10539',1.0,NULL,1.79590997743936491015e+09,2.50162773132324218745e+01,1795909977.61585,1.79590998372429633137e+09,1.79590998609766459466e+09,2.19941133,8.48037448100001256534e+00,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',9,'assemble','assemble','render/0003',3,NULL,NULL,NULL,'thumbs/0003.webp',320,'done','727a6e9bc7baa3ee81d5576d',1,0,'[]','vm-10539',1.0,NULL,1.7959099861744060516e+09,2.50162773132324218745e+01,1.79590999732445716864e+09,1.79590999732445716864e+09,1.79590999739072489736e+09,1.54547140000000915449e-02,7.74956239999937679385e-02,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',10,'render','render/0004',NULL,4,0,0,NULL,'tiles/0004/00-00.exr',3200,'done','ea369259cf5c75800ac6d3af',1,0,'[]','vm-10539',1.0,NULL,1.79590997761466813088e+09,2.50162773132324218745e+01,1.79590998620813775059e+09,1795909997.30444,1.79590999731588530545e+09,2.42907036599999948123e+00,1.11796607779999703782e+01,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',11,'render','render/0004',NULL,4,1,0,NULL,'tiles/0004/01-00.exr',3200,'running','2a8557981cc4d323980cd9a7',1,0,'[]','vm-10539',NULL,NULL,1.79590999732225680349e+09,2.50162773132324218745e+01,1.79590999741232466694e+09,1.79590999741232466694e+09,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',12,'assemble','assemble','render/0004',4,NULL,NULL,NULL,'thumbs/0004.webp',320,'waiting',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',13,'render','render/0005',NULL,5,0,0,NULL,'tiles/0005/00-00.exr',3200,'dispatched','249598644776f50f49a0ce49',1,0,'[]',NULL,NULL,NULL,1.79590999741119718546e+09,2.50162773132324218745e+01,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',14,'render','render/0005',NULL,5,1,0,NULL,'tiles/0005/01-00.exr',3200,'ready',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',15,'assemble','assemble','render/0005',5,NULL,NULL,NULL,'thumbs/0005.webp',320,'waiting',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',16,'render','render/0006',NULL,6,0,0,NULL,'tiles/0006/00-00.exr',3200,'ready',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',17,'render','render/0006',NULL,6,1,0,NULL,'tiles/0006/01-00.exr',3200,'ready',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',18,'assemble','assemble','render/0006',6,NULL,NULL,NULL,'thumbs/0006.webp',320,'waiting',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',19,'encode','encode','assemble',NULL,NULL,NULL,'views.mp4','video/views.mp4',320,'waiting',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',20,'encode','encode','assemble',NULL,NULL,NULL,'orthoscopic.mkv','video/orthoscopic.mkv',320,'failed',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,'artifact-broken','0003.exr: expected rows within 80, got 0 to 16',0,2);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',21,'encode','encode','assemble',NULL,NULL,NULL,'quilt.png','exports/quilt.png.json',320,'waiting',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
INSERT INTO "tasks" VALUES('1m8j94n5kw1dre9x2',22,'encode','encode','assemble',NULL,NULL,NULL,'depth.png','exports/depth.png.json',320,'waiting',NULL,0,0,'[]',NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,NULL,0,0);
CREATE TABLE worker_faults (
	job_id VARCHAR(32) NOT NULL, 
	worker VARCHAR(200) NOT NULL, 
	failures BIGINT NOT NULL, 
	until_s DOUBLE, 
	PRIMARY KEY (job_id, worker), 
	FOREIGN KEY(job_id) REFERENCES jobs (id)
);
INSERT INTO "worker_faults" VALUES('1m8j94n5kw1dre9x2','old-worker',2,1900000300.0);
CREATE INDEX ix_credentials_kind ON credentials (kind);
CREATE INDEX ix_job_events_job ON job_events (job_id, id);
CREATE INDEX ix_jobs_chore ON jobs (chore);
CREATE INDEX ix_jobs_status ON jobs (status);
CREATE INDEX ix_tasks_job_frame ON tasks (job_id, frame);
CREATE INDEX ix_tasks_job_needs ON tasks (job_id, needs, status);
CREATE INDEX ix_tasks_job_stage ON tasks (job_id, stage, status);
CREATE INDEX ix_tasks_job_status ON tasks (job_id, status, sequence);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('job_events',94);
COMMIT;
