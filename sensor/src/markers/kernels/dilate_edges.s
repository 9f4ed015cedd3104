@ The edges of a row of the mask, dilated once: see `dilate_edges` in cortex_m7.rs.
@
@ r0, r4, r5 behind the words of three rows   r1 the highest bit   r2 words left, negative
@ r3 column of the word   r6 the word   r7 the one to its right   r8 the one to its left
@ r9, lr scratch   r10 the last bit of the dilated word to the left   r11 where edges go
@ r12 edges, mirrored   stack: where edges go, bits of the last word

    .syntax unified
    .section .itcm.hivtac_dilate_edges, "ax", %progbits
    .balign 8
    .global hivtac_dilate_edges
    .type hivtac_dilate_edges, %function
    .thumb_func
hivtac_dilate_edges:
    push   {r4-r11, lr}
    add    r0, r0, r2, lsl #2
    ldr    r11, [sp, #36]
    add    r4, r0, r1
    rsb    r2, r2, #0
    add    r5, r4, r1
    ldr    r6, [r0, r2, lsl #2]
    ldr    r7, [r4, r2, lsl #2]
    mov    r10, #0
    ldr    r9, [r5, r2, lsl #2]
    orr    r6, r6, r7
    mov    r1, #0x80000000
    orr    r6, r6, r9
    mov    r8, #0
.Lhivtac_dilate_edges_word:
    adds   r2, r2, #1
    mov.w  r7, #0
    beq    .Lhivtac_dilate_edges_last
    ldr    r7, [r0, r2, lsl #2]
    ldr    r9, [r4, r2, lsl #2]
    ldr    r12, [r5, r2, lsl #2]
    orr    r7, r7, r9
    orr    r7, r7, r12
.Lhivtac_dilate_edges_last:
    orr    r12, r6, r7
    orrs   r12, r12, r10
    beq    .Lhivtac_dilate_edges_next
    orr    r9, r6, r6, lsl #1
    orr    r9, r9, r6, lsr #1
    orr    r9, r9, r8, lsr #31
    orr    r9, r9, r7, lsl #31
    cbnz   r2, .Lhivtac_dilate_edges_mark
    ldr    r12, [sp, #40]
    and    r9, r9, r12
.Lhivtac_dilate_edges_mark:
    orr    r12, r10, r9, lsl #1
    lsr    r10, r9, #31
    eors   r12, r12, r9
    beq    .Lhivtac_dilate_edges_next
    rbit   r12, r12
.Lhivtac_dilate_edges_edge:
    clz    lr, r12
    add    r9, r3, lr
    lsr    lr, r1, lr
    strh   r9, [r11], #2
    bics   r12, r12, lr
    bne    .Lhivtac_dilate_edges_edge
.Lhivtac_dilate_edges_next:
    mov    r8, r6
    mov    r6, r7
    add    r3, r3, #32
    cmp    r2, #0
    bne    .Lhivtac_dilate_edges_word
    mov    r0, r11
    pop    {r4-r11, pc}
    .size hivtac_dilate_edges, . - hivtac_dilate_edges
