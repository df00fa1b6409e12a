### What the reader of thermal images must know

remark-kelvin_suspected = the mean of the pixels is above 230 °C: is the file in kelvin?
remark-empty_last_column = every line ends in a separator: the empty last column was left out
remark-decimal_commas_suspected = all temperatures are whole numbers separated by commas: if the program writes a decimal comma, export with semicolons
remark-flir_unverified = read by the library flyr; not verified on a real file
remark-camera_settings = emissivity { $emissivity }, reflected temperature { FIXED($reflected_c, decimals: 1) } °C
remark-camera_clock = taken { $moment } by the clock of the camera
remark-pixels_missing = { $missing } of { $pixels } pixels are missing in the first image or the last one
remark-region_without_mean = region { $region } has no mean: every pixel is missing in one image or another
remark-emissivity_corrected = apparent temperatures were corrected for an emissivity of { $emissivity } and surroundings at { $reflected_c } °C; in CSV by fourth powers of the temperature (total radiation), an approximation of what a camera sees
remark-emissivity_low = with an emissivity below 0.6 the result depends on the surroundings as much as on the surface: paint or tape it
remark-image_at_edge_of_run = an image taken just before or after the run is set beside its first or last reading
remark-image_outside_run = image { $images } was taken outside the run: its drift is not extrapolated
remark-images_without_times = the images have no times: the first is taken as the start of the run, the last as its end
remark-no_drift_to_explain = the run has no significant drift: there is nothing to explain
remark-images_without_correlation = { $images } images within the run have no correlation with its drift: the changes stand side by side; three images or more with --times would tell more
remark-correlation_no_proof = whatever warms up together correlates: a correlation over one warming is a hint at where the heat comes from, not a proof
