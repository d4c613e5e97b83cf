"""Numbers in, numbers out: spectra, modes, joints, direct method, forward prediction, comparison, the gap.

Nothing here reads a file, opens a connection or knows the origin of a number. The contents:

- Types that all use: `dof`, `frequency_response`, `modes`, `interval`, `errors`.
- `structure`: the beam and its joints (`beam`, `element`, `joints`), prediction (`forward`), measured against predicted
  modes (`agreement`), the quantities of a bench and Figs. 3 and 4 (`bench_design`). Tables 2 to 4: `tables`.
- `modal`: from blows to modes (`blow_check`, `spectra`, `lscf`, `stabilisation`, `estimation`).
- `inverse`: joints from modes, as in the paper (`expansion`, `regression`, `identification`), and from accelerances by
  maximum likelihood (`joint_likelihood`, `joint_fit`, `response_model`, `tolerances`, `validity_checks`); joints may
  follow frequency (`frequency_laws`, `law_choice`). `observability` and `undetermined_terms` find which terms the data
  determine, `apparent_stiffness` at which lines a measured stiffness can be that of a joint. Before the test:
  `experiment_information`, `experiment_remedies`.
- `suspended`: the test of the suspended beam (`free_modes`, `beam_update`, `characterisation`).
- `direct`: the tester (`sine`, `dynamic_stiffness`, `corrections`, `cylinder_terms`, `elastomer_law`, `standards`).
- `chain`: checks of a measuring chain.
- Both rigs together: `comparison`, at the amplitudes of `joint_amplitude`. `gap`: what explains the difference between
  simulation and measurement.
"""
