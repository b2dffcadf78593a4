"use strict";
/* Tables to copy: a button that copies, and a link that saves what stands in the text field. */
for (const box of document.querySelectorAll(".copies")) {
  const text = box.querySelector("textarea");
  const link = box.querySelector("a");
  link.href = URL.createObjectURL(new Blob([text.value], { type: `${link.type};charset=utf-8` }));
  box.querySelector("button").addEventListener("click", async () => {
    text.select();
    try {
      await navigator.clipboard.writeText(text.value);
    } catch {
      document.execCommand("copy"); // browsers that give pages from a disk no clipboard
    }
    box.querySelector("output").textContent = "copied";
  });
}
