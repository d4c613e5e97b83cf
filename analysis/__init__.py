"""Numbers in, numbers out: spectra, modes, joints, direct method, forward prediction, comparison.

Nothing here reads a file, opens a connection or knows where a number came from. What stands where:

- Words shared by all: `dof`, `frequency_response`, `modes`, `interval`, `errors`.
- The beam and what holds it: `beam`, `element`, `joints`, `supported_beam`, `forward`, `mode_agreement`; studies of
  Figs. 3 and 4 and a new bench's quantities in `conditioning`, `bench_design`; Tables 1 to 4 in `tables`.
- From blows to modes: `blow_check`, `point_check`, `spectra`, `response_variance`, `modal_scatter`; `lscf`,
  `stabilisation`, `modal`, `modal_model`, `modal_refinement`, `mode_selection`, `pole_parameters`.
- Joints from modes, the paper's way: `longitudinal`, `expansion`, `regression`, `identification`, `joint_estimate`,
  `propagation`, `observability`, `term_information`, `weak_directions`.
- Joints from accelerances, by maximum likelihood: `joint_likelihood`, `joint_fit`, `joint_parameters`,
  `cylinder_parameters`, `tolerances`, `response_model`, `response_jacobian`, `response_likelihood`, `response_band`,
  `beam_motion`, `levenberg_marquardt`, `gates`; before the test: `experiment_information`, `experiment_remedies`.
- The suspended bar: `free_beam`, `free_modes`, `suspension`, `rayleigh`, `beam_slopes`, `beam_update`,
  `beam_identifiability`.
- The tester: `sine`, `block_scatter`, `direct`, `cylinder_terms`, `superposition`, `specimen_scatter`, `standards`;
  corrections in `corrections`, `applied_correction`, `rig_calibration`, `temperature`, `weighting`; a law in
  `constitutive`, `discrepancy`, `law_fit`, `elastomer_law`, `joint_law`.
- Both together: `comparison`, at the amplitude of `blow_amplitude`.
"""
