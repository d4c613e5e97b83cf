"""Numbers in, numbers out: spectra, modes, joints, direct method, forward prediction, comparison, the gap.

Nothing here reads a file, opens a connection or knows where a number came from. What stands where:

- Words shared by all: `dof`, `frequency_response`, `modes`, `interval`, `errors`.
- `structure`: the beam and what holds it (`beam`, `element`, `joints`, `supported_beam`, `forward`, `mode_agreement`);
  studies of Figs. 3 and 4 and a new bench's quantities (`conditioning`, `bench_design`). Tables 1 to 4: `tables`.
- `modal`: from blows to modes (`blow_check`, `point_check`, `spectra`, `lscf`, `stabilisation`, `estimation`).
- `inverse`: joints from modes, the paper's way (`expansion`, `identification`, `weak_directions`), and from
  accelerances by maximum likelihood (`joint_likelihood`, `joint_fit`, `response_model`, `tolerances`, `checks`), be
  they constant or follow frequency (`following_joints`); which lines of an apparent stiffness can be one:
  `apparent_stiffness`; before the test: `experiment_information`, `experiment_remedies`.
- `suspended`: the suspended bar, a test of its own (`characterisation`, `beam_update`, `material`).
- `direct`: the tester (`sine`, `dynamic_stiffness`, `corrections`, `superposition`, `standards`, `elastomer_law`).
- Both rigs together: `comparison`, at the amplitude of `blow_amplitude`; `gap`, what no model explains.
"""
