// The parts of the face, each with a box that hides it.

/** Lists the stage's meshes by part in `#part-list`, which the button `#parts` opens. */
export class PartsList {
  constructor(stage) {
    this.stage = stage;
    this.list = document.getElementById('part-list');
    this.button = document.getElementById('parts');
    const byName = grouped(stage.meshes);
    this.list.append(...[...byName].map(([name, meshes]) => this.#item(name, meshes)));
    this.list.addEventListener('keydown', (event) => {
      if (event.key !== 'Escape') return;
      this.setOpen(false);
      this.button.focus();
    });
  }

  get isOpen() {
    return !this.list.hidden;
  }

  setOpen(open) {
    this.list.hidden = !open;
    this.button.setAttribute('aria-expanded', open);
  }

  #item(name, meshes) {
    const label = document.createElement('label'), box = document.createElement('input');
    box.type = 'checkbox';
    box.checked = true;
    box.addEventListener('change', () => {
      for (const mesh of meshes) mesh.visible = box.checked;
      this.stage.invalidate();
    });
    label.append(box, name);
    return label;
  }
}

/** Meshes by the name of their material: of one part there may be several. */
function grouped(meshes) {
  const groups = new Map();
  for (const mesh of meshes) {
    const name = mesh.material.name || mesh.name || 'face';
    groups.set(name, [...(groups.get(name) ?? []), mesh]);
  }
  return groups;
}
